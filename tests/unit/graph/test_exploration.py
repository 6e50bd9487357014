import numpy as np
import pytest

from hoz_dist.graph.exploration import explore
from hoz_dist.nav.actions import Action
from hoz_dist.nav.pose import PITCHES, YAWS
from tests.unit.graph.samples import open_floor


def test_every_view_is_seen_once() -> None:
    room = open_floor(5, 4)
    seen = explore(room.transitions, "kitchen/3")
    assert sorted(seen) == list(range(room.views))


def test_walk_depends_on_the_name_of_the_room_alone() -> None:
    room = open_floor(4, 4)
    first = explore(room.transitions, "kitchen/3")
    np.testing.assert_array_equal(first, explore(room.transitions, "kitchen/3"))
    assert not np.array_equal(first, explore(room.transitions, "kitchen/4"))


def test_rooms_are_turned_around_in_either_direction() -> None:
    room = open_floor(3, 3)
    turns = set()
    for number in range(1, 21):
        first, second = explore(room.transitions, f"kitchen/{number}", budget=1)
        turns.add(int(np.flatnonzero(room.transitions[first] == second)[0]))
    assert turns == {Action.ROTATE_LEFT, Action.ROTATE_RIGHT}


def test_agent_looks_all_around_before_it_leaves() -> None:
    room = open_floor(3, 3)
    views_per_position = len(YAWS) * len(PITCHES)
    seen = explore(room.transitions, "bedroom/1")
    assert len(set(seen[:views_per_position] // views_per_position)) == 1


def test_each_new_view_follows_by_legal_moves() -> None:
    room = open_floor(3, 2)
    seen = explore(room.transitions, "bathroom/2")
    reached = {int(seen[0])}
    for view in seen[1:]:
        assert any(view in room.transitions[known, : Action.DONE] for known in reached)
        reached.add(int(view))


@pytest.mark.parametrize("budget", [0, 1, 7, 40])
def test_budget_limits_the_actions(budget: int) -> None:
    room = open_floor(4, 4)
    seen = explore(room.transitions, "kitchen/3", budget)
    assert 1 <= len(seen) <= budget + 1
    np.testing.assert_array_equal(seen, explore(room.transitions, "kitchen/3")[: len(seen)])


def test_views_that_cannot_be_reached_are_left_out() -> None:
    stuck = np.tile(np.arange(4)[:, None], (1, len(Action))).astype(np.int32)
    assert len(explore(stuck, "kitchen/1")) == 1
