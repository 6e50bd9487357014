"""Files of costs, and what follows from costs."""

import json
from typing import Any

import pytest

from hoz_dist.errors import DamagedFileError, InvalidValueError, UnknownNameError
from hoz_dist.scaling.costs import SHIPPED, Costs, costs_of, shipped_costs
from hoz_dist.scaling.designs import designs
from tests.unit.scaling.making import costs, setting


def test_a_file_gives_back_what_was_written() -> None:
    some = costs(act=0.5, crowding=0.1, switching=0.2, learn_from="rollouts")
    assert Costs.from_text(some.to_text(), "costs.json") == some


@pytest.mark.parametrize("preset", SHIPPED)
def test_costs_of_both_presets_are_shipped(preset: str) -> None:
    shipped, *others = shipped_costs(preset)
    assert (shipped.preset, shipped.learn_from) == (preset, "gradients")
    assert [other.learn_from for other in others] in ([], ["rollouts"])
    for one in (shipped, *others):
        assert one.act > 0
        assert "bench train" in one.command
        assert one.modelled_one == pytest.approx(one.measured_one, rel=0.05)
        assert one.modelled_two == pytest.approx(one.measured_two, rel=0.05)


def test_what_does_not_depend_on_the_size_is_what_a_line_through_both_presets_says() -> None:
    small, large = (shipped_costs(preset)[0] for preset in SHIPPED)
    stages = [(getattr(small, name), getattr(large, name)) for name in ("receive", "apply", "publish", "serve")]
    grows = [(much - little) / (large.parameters - small.parameters) for little, much in stages]
    rest = [little - each * small.parameters for (little, _), each in zip(stages, grows, strict=True)]
    assert small.fixed == pytest.approx(sum(rest) / len(rest), rel=0.3)


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
        ({"gil": 1.5}, "'gil' of the costs is 1.5"),
        ({"parameters": 0}, "'parameters' of the costs is 0"),
        ({"compress": "zip"}, "Unknown compression 'zip'"),
        ({"more": 1}, "missing or unknown: more"),
        ({"act": None}, "missing or unknown: act"),
        ({"switching": None}, "missing or unknown: switching"),
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


def test_what_a_learner_does_with_a_rollout_is_estimated_unless_it_was_measured() -> None:
    gradients = costs(act=0.1, differentiate=0.2, apply=0.03, compress="int8")
    estimated = costs_of([gradients], "rollouts")
    assert (estimated.differentiate, estimated.compress) == (0.0, "fp32")
    assert estimated.apply == pytest.approx(0.33)
    assert estimated.bytes_up == pytest.approx(17 * 100 * 21 / 20)
    measured = costs(apply=0.3, learn_from="rollouts")
    assert costs_of([gradients, measured], "rollouts") is measured
    assert costs_of([gradients, measured]) is gradients
    with pytest.raises(InvalidValueError, match="measurement of their own"):
        costs_of([measured], "gradients")


def test_rollouts_are_not_compressed() -> None:
    with pytest.raises(InvalidValueError, match="Only gradients are compressed"):
        costs(learn_from="rollouts").adapted(compress="topk")


def test_only_an_estimate_is_called_one() -> None:
    setting_ = setting(actors=4)
    gradients, rollouts = costs(), costs(learn_from="rollouts")
    assert [one.name for one in designs([gradients], setting_)][2] == "rollouts, deltas (estimated)"
    assert [one.name for one in designs([gradients, rollouts], setting_)][2] == "rollouts, deltas"


def test_a_smaller_part_is_cheaper_but_for_what_is_fixed_and_asks_less() -> None:
    part = costs(apply=0.11, serve=0.005, fixed=0.01, learner_wire=0.4, parameters=1_000_000).part(10)
    assert (part.apply, part.serve) == pytest.approx((0.02, 0.005))
    assert part.learner_wire == pytest.approx(0.04)
    assert part.questions == 1


def test_the_lock_is_held_in_the_interpreter_and_for_a_share_of_the_rest() -> None:
    some = costs(fixed=0.01, gil=0.5)
    assert some.held(0.03) == pytest.approx(0.02)
    assert some.held(0.004) == pytest.approx(0.004)
