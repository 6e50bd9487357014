"""From what runs of one and two actors took to the costs that `hoz-dist simulate` computes with."""

from hoz_dist.bench.report import Metric, this_machine
from hoz_dist.bench.training import Measured, Window
from hoz_dist.config import RunConfig
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.scaling.calibration import fitted
from hoz_dist.scaling.costs import Costs


def measured_costs(
    config: RunConfig, one: Measured, two: Measured, turns: Metric | None, cores: int, command: str
) -> Costs:
    """Return the costs of an update on this machine.

    What the stages of a process do not account for is counted as Zenoh's threads'. Of a run that learns from rollouts
    these are the costs of that: the learner's computing of gradients counts as applying.

    Args:
        config: Configuration of the runs.
        one: A run with one actor.
        two: A run with two.
        turns: What `hoz_dist.bench.training.turns_metric` makes of processes that take turns on a core; None if none
            could be made to.
        cores: Cores of this machine.
        command: What measured them.
    """

    def actor(*stages: str) -> float:
        return one.median(lambda window: sum(window.actor(f"{stage}.cpu") for stage in stages))

    def learner(*stages: str) -> float:
        return one.median(lambda window: sum(window.of_learner(f"{stage}.cpu") for stage in stages))

    machine = this_machine()
    costs = Costs(
        preset=config.preset,
        machine=f"{machine['cpu']}, {cores} cores",
        command=command,
        learn_from=config.learn_from,
        compress=config.compress,
        parameters_form=config.parameters,
        parameters=initial_parameters(config.policy, config.seed).size,
        frames=one.median(lambda window: window.actor("frames")),
        act=actor("act"),
        differentiate=actor("differentiate"),
        load=actor("load", "report", "rooms", "wait"),
        push=actor("push", "answer"),
        fetch=actor("parameters"),
        actor_wire=one.median(lambda window: _rest(window.actors) / window.updates),
        receive=learner("receive"),
        apply=learner("apply", "differentiate"),
        publish=learner("publish"),
        serve=learner("serve"),
        record=learner("record", "idle"),
        learner_wire=one.median(lambda window: _rest(window.learner) / window.updates),
        switching=max(turns.median - 1.0, 0.0) if turns is not None else 0.0,
    )
    return fitted(costs, cores, one.median(_speed), two.median(_speed))


def _speed(window: Window) -> float:
    return window.frames_per_second


def _rest(totals: dict[str, float]) -> float:
    """Return the CPU time of a process that is not of its stages."""
    return max(totals["cpu"] - sum(value for name, value in totals.items() if name.endswith(".cpu")), 0.0)
