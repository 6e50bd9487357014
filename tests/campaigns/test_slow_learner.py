"""A learner that is too slow for its actors tells them so, and loses nothing."""

from pathlib import Path

import pytest

from tests.campaigns import report
from tests.campaigns.slow_learner import slow_learner

pytestmark = pytest.mark.integration


def test_a_slow_learner_for_a_moment(free_port: int, tmp_path: Path) -> None:
    figures = slow_learner(tmp_path / "slow", free_port, before_s=1.0, seconds=3.0)
    assert figures.wrong == []


@pytest.mark.long
def test_a_slow_learner(free_port: int, tmp_path: Path) -> None:
    figures = slow_learner(tmp_path / "slow", free_port, before_s=20.0, seconds=180.0)
    report.keep("SLOW LEARNER", figures.to_json())
    assert figures.wrong == []
