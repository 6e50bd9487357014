"""From what an actor did and saw to the message that a learner sees it all from."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from hoz_dist.nav.observation import Observation
from hoz_dist.policy.state import Decision
from hoz_dist.sim.batch_env import Places, Step
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.wire.protocol.trajectories import Flag, RoomUsed, Steps


class Seen(NamedTuple):
    """One look of B agents."""

    observation: Observation
    places: Places
    decision: Decision


class Acted(NamedTuple):
    """One step of B agents."""

    observation: Observation
    places: Places
    decision: Decision
    actions: Tensor
    """[B]."""
    step: Step


def steps_of(acted: Sequence[Acted], after: Seen, rooms: Sequence[RoomViews]) -> tuple[Steps, tuple[RoomUsed, ...]]:
    """Return a rollout as it travels, and the rooms that it passed through.

    Args:
        acted: T steps.
        after: What was seen after the last one.
        rooms: The rooms that places count.

    Raises:
        RejectedError: A value cannot travel: a probability was not finite.
    """
    seen = [*(Seen(*moment[:3]) for moment in acted), after]
    used, room = np.unique(np.stack([moment.places.room for moment in seen]), return_inverse=True)

    def rows(part: Callable[[Seen], NDArray[Any] | Tensor], dtype: type[np.generic]) -> NDArray[Any]:
        return np.stack([np.asarray(part(moment)) for moment in seen]).astype(dtype)

    steps = Steps(
        room=room.reshape(len(seen), -1).astype(np.uint8),
        view=rows(lambda moment: moment.places.view, np.uint16),
        target=rows(lambda moment: moment.observation.target, np.uint8),
        flags=_flags(acted, seen),
        scene=rows(lambda moment: moment.decision.guidance.scene, np.uint8),
        current=rows(lambda moment: moment.decision.guidance.current, np.uint8),
        subgoal=rows(lambda moment: moment.decision.guidance.subgoal, np.uint8),
        previous_action=acted[0].observation.previous_action.astype(np.uint8),
        action=np.stack([moment.actions.numpy() for moment in acted]).astype(np.uint8),
        reward=np.stack([moment.step.reward for moment in acted]),
        log_probability=np.stack([_log_probability(moment) for moment in acted]),
    )
    return steps, tuple(RoomUsed(rooms[number].room, rooms[number].digest) for number in used)


def _flags(acted: Sequence[Acted], seen: Sequence[Seen]) -> NDArray[np.uint8]:
    """Return the flags of each row, [T + 1, B]."""
    flags = np.stack([moment.observation.first for moment in seen]) * np.uint8(Flag.FIRST)
    flags |= np.stack([moment.decision.guidance.fresh.numpy() for moment in seen]) * np.uint8(Flag.FRESH)
    for name, flag in (("terminated", Flag.TERMINATED), ("truncated", Flag.TRUNCATED), ("valid", Flag.VALID)):
        flags[:-1] |= np.stack([getattr(moment.step, name) for moment in acted]) * np.uint8(flag)
    return flags


def _log_probability(moment: Acted) -> NDArray[np.float32]:
    """Return the log-probability of each action under the policy that took it, [B]."""
    all_of_them = moment.decision.logits.log_softmax(dim=-1)
    chosen = all_of_them.gather(-1, moment.actions.unsqueeze(-1)).squeeze(-1)
    # Rounding must not make a certain action more than certain.
    return chosen.clamp(max=0.0).numpy()
