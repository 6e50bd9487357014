"""What runs of one and two actors took, as costs of an update."""

import pytest

from hoz_dist.bench.costs import measured_costs
from hoz_dist.bench.report import Metric
from hoz_dist.bench.training import Measured, Window
from hoz_dist.config import RunConfig
from hoz_dist.scaling.costs import Costs
from tests.unit.bench.test_training import Still

ACTOR = {"act": 4.0, "push": 0.2, "answer": 0.1, "wait": 0.05, "parameters": 0.3, "load": 0.1, "rooms": 0.05}
LEARNER = {"receive": 0.1, "differentiate": 2.0, "apply": 0.1, "publish": 0.1, "serve": 0.2, "record": 0.1, "idle": 0.1}


def run_of(seconds: float) -> Measured:
    """A window of 10 updates and 1000 frames; stages as they are said, and 0.5 s of Zenoh's threads on either side."""
    actors = {f"{stage}.cpu": cpu for stage, cpu in ACTOR.items()}
    actors |= {"updates": 10.0, "frames": 1000.0, "cpu": sum(ACTOR.values()) + 0.5}
    learner = {f"{stage}.cpu": cpu for stage, cpu in LEARNER.items()} | {"cpu": sum(LEARNER.values()) + 0.5}
    return Measured(Still(), [Window(seconds, actors, learner)])


def test_all_that_processors_did_is_some_cost_of_an_update() -> None:
    config = RunConfig(learn_from="rollouts", parameters="delta")
    found = measured_costs(config, run_of(0.2), run_of(0.1), None, 2, "hoz-dist bench train")
    assert (found.learn_from, found.parameters_form, found.frames) == ("rollouts", "delta", 100.0)
    assert (found.act, found.push, found.load) == pytest.approx((0.4, 0.03, 0.02))
    assert found.apply == pytest.approx(0.21)  # and the computing of gradients, which a learner of rollouts does
    assert found.record == pytest.approx(0.02)
    assert (found.actor_wire, found.learner_wire) == pytest.approx((0.05, 0.05))
    own = (found.act, found.differentiate, found.load, found.push, found.fetch, found.actor_wire)
    assert sum(own) == pytest.approx((sum(ACTOR.values()) + 0.5) / 10)
    assert (found.measured_one, found.measured_two) == pytest.approx((5000, 10_000))
    assert Costs.from_text(found.to_text(), "costs.json") == found


@pytest.mark.parametrize(("turns", "switching"), [([1.1, 1.2, 1.5], 0.2), ([0.8, 0.9, 1.1], 0.0), (None, 0.0)])
def test_turns_cost_what_they_take_longer_and_never_less_than_nothing(
    turns: list[float] | None, switching: float
) -> None:
    ratio = Metric.of(turns, "x alone", 1.0) if turns is not None else None
    found = measured_costs(RunConfig(), run_of(0.2), run_of(0.1), ratio, 2, "hoz-dist bench train")
    assert found.switching == pytest.approx(switching)
