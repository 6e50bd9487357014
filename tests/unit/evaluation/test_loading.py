import numpy as np
import pytest

from hoz_dist.config import RunConfig
from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.evaluation.loading import load_agent, matching_encoder
from hoz_dist.policy.parameters import initial_parameters


@pytest.mark.parametrize("parameters", [10, 208_721], ids=["none", "of an agent that did not feel what failed"])
def test_parameters_of_another_network_are_refused(parameters: int) -> None:
    complaint = rf"has {parameters} parameters, .* 208737: it may be of an older version of hoz-dist; use the"
    with pytest.raises(InvalidValueError, match=complaint):
        load_agent(RunConfig(), np.zeros(parameters, dtype=np.float32), {})


def test_a_guided_method_needs_a_graph() -> None:
    config = RunConfig(method="hoz")
    with pytest.raises(NotFoundError, match="no scene graph"):
        load_agent(config, initial_parameters(config.policy, config.seed), {})
    plain = RunConfig(method="object")
    assert load_agent(plain, initial_parameters(plain.policy, plain.seed), {}).name == "object"


def test_an_encoder_with_other_weights_is_refused() -> None:
    assert matching_encoder(RunConfig(), None).key == RunConfig().encoder_key
    with pytest.raises(InvalidValueError, match="encoder"):
        matching_encoder(RunConfig(encoder_key="pooled-0"), None)
