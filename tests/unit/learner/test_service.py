from pathlib import Path

import pytest

from hoz_dist.config import RunConfig
from hoz_dist.errors import InvalidValueError
from learner.service import LearnerSettings


def test_a_learner_without_views_cannot_learn_from_rollouts() -> None:
    with pytest.raises(InvalidValueError, match="source of views"):
        LearnerSettings(run=Path("run"), config=RunConfig(learn_from="rollouts"))
    LearnerSettings(run=Path("run"), config=RunConfig())
