"""Which pushes the learner learns from."""

from collections.abc import Iterator
from typing import Final

from hoz_dist.config import RunConfig
from hoz_dist.wire.protocol.gradients import codec_of
from hoz_dist.wire.protocol.pushes import GradientPush
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.trajectories import TrajectoryPush
from learner.replay import Schedule

MOST_NAMED: Final = 20
"""Recorded actors that are named to one that is not among them."""

Refusal = tuple[Reason, str]
"""Reason and detail."""


class Admission:
    """Judges gradients and rollouts before anything is computed from them.

    Args:
        config: Configuration of the run.
        epoch: Epoch of the learner.
        size: P, number of parameters.
        schedule: Recorded updates that are repeated.
    """

    def __init__(self, config: RunConfig, epoch: int, size: int, schedule: Schedule | None) -> None:
        self._config = config
        self._epoch = epoch
        self._size = size
        self._schedule = schedule

    def refusal(self, push: GradientPush | TrajectoryPush, version: int, *, finished: bool) -> Refusal | None:
        """Return why a push cannot be learnt from; None when it can, unless what is computed from it cannot.

        Args:
            push: The push; its numbers are finite, but for those of a gradient in full.
            version: Of the newest parameters.
            finished: Whether the budget is used up.
        """
        checks = [
            *self._of_any(push, version, finished=finished),
            *(self._of_gradient(push) if isinstance(push, GradientPush) else ()),
        ]
        return next(((reason, detail) for wrong, reason, detail in checks if wrong), None)

    def _of_any(
        self, push: GradientPush | TrajectoryPush, version: int, *, finished: bool
    ) -> Iterator[tuple[bool, Reason, str]]:
        lag, epoch, bound = version - push.version, self._epoch, self._config.most_lag
        kind, learn_from = "gradients" if isinstance(push, GradientPush) else "rollouts", self._config.learn_from
        yield kind != learn_from, Reason.KIND, f"this run learns from {learn_from}, not from {kind}"
        yield finished, Reason.FINISHED, "the budget is used up"
        if self._schedule is not None:
            recorded = ", ".join(self._schedule.actors[:MOST_NAMED])
            stranger = push.actor not in self._schedule.actors
            wanted = f"start one actor --name for each of: {recorded}"
            yield stranger, Reason.NAME, f"the recorded run has no actor '{push.actor}'; {wanted}"
        yield push.epoch != epoch, Reason.EPOCH, f"computed in epoch {push.epoch}, now is {epoch}"
        yield lag < 0, Reason.STALE, f"computed on version {push.version}, the newest is {version}"
        yield lag > bound, Reason.STALE, f"{lag} versions behind, the bound is {bound}"
        if self._schedule is not None:
            unknown = self._schedule.turn(push.actor, push.sequence) == "never"
            yield unknown, Reason.STALE, f"sequence {push.sequence} was not applied in the recorded run"

    def _of_gradient(self, push: GradientPush) -> Iterator[tuple[bool, Reason, str]]:
        size, codec, wanted = self._size, codec_of(push.gradient), self._config.compress
        most_frames = self._config.batch * self._config.rollout_steps
        yield push.gradient.size != size, Reason.SHAPE, f"{push.gradient.size} entries for {size} parameters"
        yield codec != wanted, Reason.CODEC, f"the gradient travels as {codec}; the run's do as {wanted}"
        yield push.frames > most_frames, Reason.RANGE, f"{push.frames} frames; a rollout has at most {most_frames}"
