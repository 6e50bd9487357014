"""A corridor and episodes in it whose analysis is plain to see."""

from dataclasses import replace
from typing import Final

import numpy as np

from hoz_dist.evaluation.agents import ZonePlan
from hoz_dist.evaluation.episode_analysis import EpisodeAnalysis, analyse_episodes
from hoz_dist.evaluation.trace import EpisodeTrace
from hoz_dist.nav.actions import Action
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.pose import Pose
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.room_views import RoomViews
from tests.unit.sim.making import open_grid, views_of

TARGET: Final = 8
LENGTH: Final = 7
"""Positions of the corridor, along +z."""
NEAR: Final = 4
"""From this position on Done succeeds, looking along the corridor with pitch 0."""
_LETTERS: Final = dict(zip("ALRUDX", Action, strict=True))


def corridor() -> RoomViews:
    """Make a corridor: the target is seen from everywhere but its first position, looking along it with pitch 0."""
    graph = open_grid(1, LENGTH)
    seen, success = np.zeros((2, graph.views, len(TARGETS)), dtype=np.bool_)
    for z in range(1, LENGTH):
        view = graph.view_of(Pose(0.0, 0.25 * z, 0, 0))
        seen[view, TARGET], success[view, TARGET] = True, z >= NEAR
    views = views_of(graph, success, RoomId("kitchen", 21))
    detections = np.zeros_like(views.detections)
    detections[..., 4] = seen
    return replace(views, detections=detections)


def traced(letters: str, z: int = 0, yaw: int = 0, plan: ZonePlan | None = None) -> EpisodeTrace:
    """Go through the corridor.

    Args:
        letters: Actions: A(head), L(eft), R(ight), U(p), D(own), X for Done; an episode without X reached its cap.
        z: Position at the start.
        yaw: Direction at the start, degrees.
        plan: What guided the actions.
    """
    room = corridor()
    actions = np.array([_LETTERS[letter] for letter in letters], dtype=np.int8)
    views = [room.graph.view_of(Pose(0.0, 0.25 * z, yaw, 0))]
    for action in actions:
        views.append(int(room.graph.transitions[views[-1], action]))
    said_done = letters.endswith("X")
    result = EpisodeResult(
        room=room.room,
        target=TARGET,
        success=said_done and bool(room.success[views[-1], TARGET]),
        actions=len(letters),
        moves=letters.count("A"),
        said_done=said_done,
        optimal=int(room.optimal[views[0], TARGET]),
    )
    return EpisodeTrace(result, np.array(views, dtype=np.int32), actions, plan)


def analysed(letters: str, z: int = 0, yaw: int = 0, plan: ZonePlan | None = None) -> EpisodeAnalysis:
    """Go through the corridor, and analyse it."""
    (analysis,) = analyse_episodes([traced(letters, z, yaw, plan)], [corridor()])
    return analysis


def zone_plan(current: str, subgoal: str, target: str, scene: str = "") -> ZonePlan:
    """Make the plan of an episode from digits, one for each action; scene 0 by default."""
    return ZonePlan(*(np.array([*map(int, row)]) for row in (scene or "0" * len(current), current, target, subgoal)))
