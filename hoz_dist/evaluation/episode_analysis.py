"""What became of one episode, and why: its cause of failure, its search and its approach, its use of the zones.

An episode is cut in two at the *first sight*, the first view that shows the target: the *search* goes before, the
*approach* after. Views are counted when something is decided there, so the last view of an episode that reached its cap
does not count: the agent never looked at it.
"""

from collections.abc import Iterable, Iterator, Sequence
from enum import StrEnum
from functools import cache
from typing import Any, Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from hoz_dist.evaluation.agents import ZonePlan
from hoz_dist.evaluation.trace import EpisodeTrace
from hoz_dist.nav.actions import Action
from hoz_dist.nav.categories import SCENES
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.room_views import RoomViews

NEVER: Final = -1
"""Number of actions until something that did not happen."""


class Cause(StrEnum):
    """How an episode ended; every episode ended in exactly one of these ways."""

    SUCCESS = "success"
    WRONG_DONE_FAR = "wrong_done_far"
    """Done was said with the target in view, but too far away."""
    WRONG_DONE_UNSEEN = "wrong_done_unseen"
    """Done was said with the target not in view."""
    TIME_OUT_AT_TARGET = "time_out_at_target"
    """The time ran out, though Done would have succeeded at a view that was visited."""
    LOST = "lost"
    """The time ran out; the target was seen, but never from near enough."""
    NEVER_SEEN = "never_seen"
    """The time ran out before the target was seen."""


class Kinds(NamedTuple):
    """Numbers of actions of each kind; Done is none of them."""

    moves: int = 0
    """MoveAhead that moved the agent."""
    blocked: int = 0
    """MoveAhead that did not, because something was in the way."""
    turns: int = 0
    looks: int = 0
    """LookUp and LookDown, also those that changed nothing."""

    @classmethod
    def of(cls, actions: NDArray[np.integer], views: NDArray[np.integer]) -> Self:
        """Count actions [A], taken at the first of views [A + 1]."""
        ahead, stays = actions == Action.MOVE_AHEAD, views[1:] == views[:-1]
        turns = (actions == Action.ROTATE_LEFT) | (actions == Action.ROTATE_RIGHT)
        looks = (actions == Action.LOOK_UP) | (actions == Action.LOOK_DOWN)
        return cls(*(int(kind.sum()) for kind in (ahead & ~stays, ahead & stays, turns, looks)))


class ZoneUse(NamedTuple):
    """What an agent made of its plans. A sub-goal that is the current zone leads nowhere, and is not counted as one."""

    steps: int
    """Actions that were guided."""
    right_scene: int
    """Of these, by the graph of the room's own scene."""
    subgoal_differs: int
    """Of these, with a sub-goal other than the target zone."""
    in_target_zone: int
    """Of these, with the current zone being the target zone."""
    subgoals: int
    """Sub-goals that were pursued; one that stays for some steps is one."""
    reached: int
    """Of these, that became the current zone before another one was set."""
    unsettled: int
    """Of these, that were neither reached nor changed when the episode ended: 0 or 1."""


class EpisodeAnalysis(NamedTuple):
    """What became of one episode. L is its number of actions without Done."""

    scene: str
    cause: Cause
    optimal: int
    """L* of the episode."""
    length: int
    """L."""
    seen_after: int
    """Actions until the target was first seen; `NEVER`."""
    seen_optimal: int
    """Least number of actions from the start until it can be seen."""
    approach_optimal: int
    """L* from the first sight; `NEVER` when there is none."""
    reached_after: int
    """Actions until Done would first have succeeded; `NEVER`."""
    search: Kinds
    """Actions before the first sight."""
    approach: Kinds
    """Actions after it."""
    revisits: int
    """Actions after which the agent was at a view where it had been before, in the same episode."""
    zones: ZoneUse | None
    """None for an agent without zones."""

    @property
    def success(self) -> bool:
        """Whether it succeeded."""
        return self.cause is Cause.SUCCESS

    @property
    def spl(self) -> float:
        """SPL of the episode, as `hoz_dist.nav.metrics.spl_of`."""
        return self.spl_with(self.length) if self.success else 0.0

    def spl_with(self, length: int) -> float:
        """SPL of a success in so many actions without Done."""
        return self.optimal / max(length, self.optimal, 1)

    @property
    def search_excess(self) -> int:
        """Actions that a success owes to its search: the first sight's way there and its best way on, less L*."""
        return self.seen_after + self.approach_optimal - self.optimal

    @property
    def approach_excess(self) -> int:
        """Actions that a success owes to its approach: from the first sight till Done would succeed, less the least."""
        return self.reached_after - self.seen_after - self.approach_optimal

    @property
    def done_excess(self) -> int:
        """Actions that a success took after Done would first have succeeded.

        The three excesses are not negative, and together with L* they are L.
        """
        return self.length - self.reached_after

    @classmethod
    def from_json(cls, values: Sequence[Any]) -> Self:
        """Read what `json` makes of an analysis: the fields in their order, those of tuples in lists."""
        read = cls(*values)
        return read._replace(
            cause=Cause(read.cause),
            search=Kinds(*read.search),
            approach=Kinds(*read.approach),
            zones=None if read.zones is None else ZoneUse(*read.zones),
        )


def analyse_episodes(traces: Iterable[EpisodeTrace], rooms: Sequence[RoomViews]) -> Iterator[EpisodeAnalysis]:
    """Analyse episodes, in their order.

    Args:
        traces: The episodes.
        rooms: The rooms of the episodes.
    """
    by_name = {views.room: views for views in rooms}
    bags = {views.room: views.bag for views in rooms}

    @cache
    def to_sight(room: RoomId, target: int) -> NDArray[np.int16]:
        return by_name[room].graph.distances_to(bags[room][:, target])

    for trace in traces:
        room, target = trace.result.room, trace.result.target
        yield analyse_episode(
            trace,
            seen=bags[room][:, target],
            near=by_name[room].success[:, target],
            optimal=by_name[room].optimal[:, target],
            to_sight=to_sight(room, target),
        )


def analyse_episode(
    trace: EpisodeTrace,
    *,
    seen: NDArray[np.bool_],
    near: NDArray[np.bool_],
    optimal: NDArray[np.integer],
    to_sight: NDArray[np.integer],
) -> EpisodeAnalysis:
    """Analyse one episode in a room of V views.

    Args:
        trace: The episode.
        seen: Whether a view shows the target, [V].
        near: Whether Done would succeed, [V]; only where the target is seen.
        optimal: L*, [V].
        to_sight: Least number of actions to a view that shows the target, [V].
    """
    result = trace.result
    decided = trace.views[:-1]
    seen_after, reached_after = _first(seen[decided]), _first(near[decided])
    length = result.actions - int(result.said_done)
    cut = length if seen_after == NEVER else seen_after
    visited = trace.views[: length + 1]
    return EpisodeAnalysis(
        scene=result.room.scene,
        cause=cause_of(trace, seen, near),
        optimal=result.optimal,
        length=length,
        seen_after=seen_after,
        seen_optimal=int(to_sight[trace.views[0]]),
        approach_optimal=NEVER if seen_after == NEVER else int(optimal[trace.views[seen_after]]),
        reached_after=reached_after,
        search=Kinds.of(trace.actions[:cut], trace.views[: cut + 1]),
        approach=Kinds.of(trace.actions[cut:length], trace.views[cut : length + 1]),
        revisits=len(visited) - len(np.unique(visited)),
        zones=None if trace.plan is None else zone_use(trace.plan, SCENES.index(result.room.scene)),
    )


def cause_of(trace: EpisodeTrace, seen: NDArray[np.bool_], near: NDArray[np.bool_]) -> Cause:
    """Say how an episode ended.

    Args:
        trace: The episode.
        seen: Whether a view shows the target, [V].
        near: Whether Done would succeed, [V].
    """
    decided = trace.views[:-1]
    if trace.result.success:
        return Cause.SUCCESS
    if trace.result.said_done:
        return Cause.WRONG_DONE_FAR if seen[decided[-1]] else Cause.WRONG_DONE_UNSEEN
    if near[decided].any():
        return Cause.TIME_OUT_AT_TARGET
    return Cause.LOST if seen[decided].any() else Cause.NEVER_SEEN


def zone_use(plan: ZonePlan, scene: int) -> ZoneUse:
    """Count what an agent made of its plans in one episode of A actions.

    Args:
        plan: What guided each action, [A].
        scene: The room's own scene, index into `SCENES`.
    """
    # Zones of different scenes have the same numbers, so a zone's name is both.
    here = np.stack([plan.scene, plan.current])
    goal = np.stack([plan.scene, plan.subgoal])
    away = (here != goal).any(axis=0)
    # A sub-goal is pursued from step to step, and each pursuit ends once: the zone is reached, or another one is set,
    # or the episode ends. A zone that is reached often counts as reached although the next one is set at once.
    reached = away[:-1] & (here[:, 1:] == goal[:, :-1]).all(axis=0)
    changed = away[:-1] & ~reached & (goal[:, 1:] != goal[:, :-1]).any(axis=0)
    unsettled = int(away[-1])
    return ZoneUse(
        steps=len(away),
        right_scene=int((plan.scene == scene).sum()),
        subgoal_differs=int((plan.subgoal != plan.target).sum()),
        in_target_zone=int((plan.current == plan.target).sum()),
        subgoals=int(reached.sum()) + int(changed.sum()) + unsettled,
        reached=int(reached.sum()),
        unsettled=unsettled,
    )


def _first(happens: NDArray[np.bool_]) -> int:
    """Return the first index at which something happens, or `NEVER`."""
    return int(happens.argmax()) if happens.any() else NEVER
