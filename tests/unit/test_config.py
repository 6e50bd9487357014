import json
from dataclasses import replace
from typing import Any

import pytest

from hoz_dist.config import RunConfig
from hoz_dist.errors import HozError, InvalidValueError, UnknownNameError
from hoz_dist.policy.encoders.pooled import PooledEncoder
from hoz_dist.policy.relations import shipped_relations


def test_json_and_back() -> None:
    config = RunConfig(method="object", minutes=3, seed=4)
    assert RunConfig.from_json(json.loads(json.dumps(config.to_json()))) == config


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"method": "dqn"}, UnknownNameError),
        ({"edge_cost": "none"}, UnknownNameError),
        ({"zones": 1}, InvalidValueError),
        ({"learning_rate": -1.0}, InvalidValueError),
        ({"learning_rate": float("nan")}, InvalidValueError),
        ({"minutes": 1.0, "frames": 5}, InvalidValueError),
        ({"learn_from": "rollouts", "compress": "topk"}, InvalidValueError),
        ({"batch": "64"}, InvalidValueError),
        ({"batch": True}, InvalidValueError),
        ({"seed": 0.5}, InvalidValueError),
        ({"colour": "red"}, InvalidValueError),
        ({"method": "sp", "relations": ["Bowl"]}, InvalidValueError),
        ({"relations": ["Bowl+Plate"]}, InvalidValueError),
        ({"method": "sp", "relations": "Bowl+Plate"}, InvalidValueError),
    ],
)
def test_bad_values_are_refused_in_one_sentence(change: dict[str, Any], error: type[HozError]) -> None:
    with pytest.raises(error) as caught:
        RunConfig.from_json(RunConfig().to_json() | change)
    assert str(caught.value).endswith(".")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("values", [None, [], {}, {"method": "hoz"}])
def test_what_is_no_configuration_is_refused(values: object) -> None:
    with pytest.raises(InvalidValueError):
        RunConfig.from_json(values)


def test_a_configuration_of_an_older_version_is_refused_as_such() -> None:
    """Runs from before the approach was taught have other networks, so nothing could go on from them."""
    values = RunConfig().to_json()
    del values["approach_weight"], values["approach_frames"]
    complaint = r"not of this version .*unknown: approach_frames, approach_weight\); use the version that made it"
    with pytest.raises(InvalidValueError, match=complaint):
        RunConfig.from_json(values)


def test_relations_are_the_shipped_ones_unless_given_and_only_of_sp() -> None:
    config = RunConfig(method="sp")
    assert config.relations == config.policy.relations == shipped_relations()
    other = RunConfig(method="sp", relations=("Bowl+Plate",))
    assert RunConfig.from_json(json.loads(json.dumps(other.to_json()))) == other
    assert config.differences(other)
    assert RunConfig(method="object").relations == ()
    with pytest.raises(InvalidValueError, match="leave 'relations' empty"):
        replace(config, method="object")
    assert replace(config, method="object", relations=()) == RunConfig(method="object")


def test_the_approach_is_taught_less_with_every_frame_until_it_is_not() -> None:
    config = RunConfig(approach_weight=0.4, approach_frames=1000, rollout_steps=10, batch=5)
    weights = [config.approach_weight_at(version) for version in (0, 5, 10, 20, 21, 10**9)]
    assert weights == pytest.approx([0.4, 0.3, 0.2, 0.0, 0.0, 0.0])
    assert min(weights) == 0.0
    assert replace(config, approach_weight=0.0).approach_weight_at(0) == 0.0


def test_differences_are_named_with_both_values() -> None:
    assert RunConfig(seed=1).differences(RunConfig(seed=2)) == ["seed: 1, 2"]
    assert RunConfig().differences(RunConfig()) == []


def test_defaults_describe_the_default_encoder() -> None:
    encoder = PooledEncoder()
    assert (RunConfig().encoder_key, RunConfig().channels) == (encoder.key, encoder.channels)


def test_what_tells_runs_apart_does_not_change_when_fields_are_added() -> None:
    values = RunConfig(method="a3c").distinguishing()
    assert values["method"] == "a3c"
    assert "clustering" not in values
    assert "approach_weight" not in RunConfig(approach_weight=0.0).distinguishing()
    assert RunConfig(clustering="random").distinguishing()["clustering"] == "random"
