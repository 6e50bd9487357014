from collections import deque

import numpy as np
import pytest
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.actions import Action
from hoz_dist.nav.pose import HEADINGS, YAWS, Pose
from hoz_dist.sim.pose_graph import PoseGraph, pose_graph_of
from tests.unit.sim.making import open_grid


def breadth_first(graph: PoseGraph, start: int, goal: NDArray[np.bool_]) -> int:
    """Count actions from one view to the nearest goal the slow way."""
    distance = {start: 0}
    queue = deque([start])
    while queue:
        view = queue.popleft()
        if goal[view]:
            return distance[view]
        for action in range(Action.DONE):
            after = int(graph.transitions[view, action])
            if after not in distance:
                distance[after] = distance[view] + 1
                queue.append(after)
    return -1


def test_every_view_has_its_own_pose_and_back() -> None:
    graph = open_grid(3, 2)
    poses = [graph.pose(view) for view in range(graph.views)]
    assert len(set(poses)) == graph.views == 3 * 2 * 8 * 2
    assert [graph.view_of(pose) for pose in poses] == list(range(graph.views))
    assert poses[(4 * 8 + 3) * 2 + 1] == Pose(0.5, 0.0, 135, 30)


def test_a_pose_outside_the_room_is_refused() -> None:
    with pytest.raises(InvalidValueError, match=r"9\.00\|0\.00\|0\|0"):
        open_grid(2, 2).view_of(Pose(9.0, 0.0, 0, 0))


@pytest.mark.parametrize("yaw", YAWS)
def test_move_ahead_follows_the_yaw_and_stops_at_the_edge(yaw: int) -> None:
    graph = open_grid(3, 3)
    dx, dz = HEADINGS[YAWS.index(yaw)]
    middle = graph.view_of(Pose(0.25, 0.25, yaw, 30))
    once = int(graph.transitions[middle, Action.MOVE_AHEAD])
    assert graph.pose(once) == Pose(0.25 + 0.25 * dx, 0.25 + 0.25 * dz, yaw, 30)
    assert graph.transitions[once, Action.MOVE_AHEAD] == once


def test_turning_and_looking() -> None:
    graph = open_grid(1, 1)
    start = graph.view_of(Pose(0.0, 0.0, 0, 0))

    def after(*actions: Action) -> Pose:
        view = start
        for action in actions:
            view = int(graph.transitions[view, action])
        return graph.pose(view)

    assert after(Action.ROTATE_RIGHT).yaw == 45
    assert after(Action.ROTATE_LEFT).yaw == 315
    assert after(*[Action.ROTATE_RIGHT] * 8) == after() == after(Action.DONE) == after(Action.LOOK_UP)
    assert after(Action.LOOK_DOWN) == after(Action.LOOK_DOWN, Action.LOOK_DOWN) == Pose(0.0, 0.0, 0, 30)
    assert after(Action.LOOK_DOWN, Action.LOOK_UP) == after()


def test_only_the_largest_connected_part_is_kept() -> None:
    graph = open_grid(7, 3, holes=frozenset((x, z) for x in (1, 5) for z in range(3)))
    assert sorted(map(tuple, graph.positions.tolist())) == [(x, z) for x in (2, 3, 4) for z in range(3)]
    assert graph.transitions.shape == (9 * 16, 6)
    assert graph.transitions.min() >= 0
    assert graph.transitions.max() < graph.views


@pytest.mark.parametrize("seed", range(3))
def test_distances_agree_with_a_search_from_each_view(seed: int) -> None:
    rng = np.random.default_rng(seed)
    graph = open_grid(4, 4, holes=frozenset({(1, 1), (2, 1), (1, 2)}))
    goal = np.zeros(graph.views, dtype=np.bool_)
    goal[rng.integers(graph.views, size=2)] = True
    assert graph.distances_to(goal).tolist() == [breadth_first(graph, view, goal) for view in range(graph.views)]


def test_without_a_goal_nothing_is_reached() -> None:
    graph = open_grid(2, 2)
    assert (graph.distances_to(np.zeros(graph.views, dtype=np.bool_)) == -1).all()


def test_one_way_moves_are_followed_in_their_direction_only() -> None:
    neighbours = np.full((2, 8), -1, dtype=np.int32)
    neighbours[0, 0] = 1
    graph = pose_graph_of(np.array([[0, 0], [0, 1]], dtype=np.int16), neighbours)
    goal = np.arange(graph.views) < 16
    assert (graph.distances_to(goal)[16:] == -1).all()
    assert (graph.distances_to(~goal) >= 0).all()
