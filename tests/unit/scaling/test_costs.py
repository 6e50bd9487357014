"""Files of costs, and what follows from costs."""

import json
from typing import Any

import pytest

from hoz_dist.errors import DamagedFileError, InvalidValueError, UnknownNameError
from hoz_dist.scaling.costs import SHIPPED, Costs, shipped_costs
from tests.unit.scaling.making import costs


def test_a_file_gives_back_what_was_written() -> None:
    some = costs(act=0.5, crowding=0.1, round_trips=7)
    assert Costs.from_text(some.to_text(), "costs.json") == some


@pytest.mark.parametrize("preset", SHIPPED)
def test_costs_of_both_presets_are_shipped(preset: str) -> None:
    shipped = shipped_costs(preset)
    assert shipped.preset == preset
    assert shipped.act > 0
    assert "bench train" in shipped.command


def test_only_known_presets_have_costs() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'paper'"):
        shipped_costs("papr")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"act": -1.0}, "'act' of the costs is -1"),
        ({"act": float("nan")}, "'act' of the costs is nan"),
        ({"act": "much"}, "'act' is 'much'"),
        ({"act": True}, "'act' is True"),
        ({"parameters": 0}, "'parameters' of the costs is 0"),
        ({"compress": "zip"}, "Unknown compression 'zip'"),
        ({"more": 1}, "missing or unknown: more"),
        ({"act": None}, "missing or unknown: act"),
    ],
)
def test_a_file_that_is_wrong_is_refused_in_one_sentence(change: dict[str, Any], named: str) -> None:
    values = json.loads(costs().to_text()) | change
    text = json.dumps({name: value for name, value in values.items() if value is not None})
    with pytest.raises(DamagedFileError, match=r"'costs\.json' is no file of costs") as caught:
        Costs.from_text(text, "costs.json")
    assert named in str(caught.value)


@pytest.mark.parametrize("text", ["", "[]", "{}", "null", "7", '{"act": '])
def test_a_file_that_is_something_else_is_refused(text: str) -> None:
    with pytest.raises(DamagedFileError, match=r"'costs\.json' is no file of costs"):
        Costs.from_text(text, "costs.json")


def test_compression_changes_the_bytes_and_zenohs_time() -> None:
    full = costs(actor_wire=0.4, receive=0.1)
    half = full.adapted(compress="bf16", parameters_form="full")
    assert (full.bytes_up, half.bytes_up, half.bytes_down) == (4000, 2000, 4000)
    assert half.actor_wire == pytest.approx(0.3)
    assert half.receive == full.receive


def test_a_learner_that_learns_from_rollouts_differentiates_itself() -> None:
    rollouts = costs(act=0.1, differentiate=0.2, apply=0.03).adapted(learn_from="rollouts")
    assert rollouts.differentiate == 0.0
    assert rollouts.apply == pytest.approx(0.23)
    assert rollouts.bytes_up == 6400
    with pytest.raises(InvalidValueError, match="measurement of their own"):
        rollouts.adapted(learn_from="gradients")
