import numpy as np

from hoz_dist.nav.actions import Action
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.expert import NO_PATH, ExpertTable, expert_actions, shortest_actions
from tests.learning.test_learns import TARGET, tiny_room
from tests.unit.sim.making import random_views


def test_the_expert_reaches_success_in_the_least_number_of_actions() -> None:
    views = tiny_room()
    actions = expert_actions(views)
    for start in range(views.graph.views):
        here, taken = start, 0
        while actions[here, TARGET] != Action.DONE:
            here, taken = int(views.graph.transitions[here, actions[here, TARGET]]), taken + 1
            assert taken < 100
        assert views.success[here, TARGET]
        assert taken == views.optimal[start, TARGET]
    assert (np.delete(actions, TARGET, axis=1) == NO_PATH).all()


def test_all_actions_that_begin_a_shortest_path_are_given_and_no_others() -> None:
    """Against a plain loop: those that lead one step nearer, or Done where nothing is left to be done."""
    views = random_views(RoomId("kitchen", 1), seed=3)
    found = shortest_actions(views)
    choices = 0
    for view, target in np.ndindex(views.optimal.shape):
        here = views.optimal[view, target]
        expected = {Action.DONE} if here == 0 else set()
        if here > 0:
            leads_to = views.graph.transitions[view]
            expected = {a for a in Action if a != Action.DONE and views.optimal[leads_to[a], target] == here - 1}
            choices += len(expected) > 1
        assert set(np.flatnonzero(found[view, target])) == expected
    assert choices > 100, "from many views several ways are as short"
    assert not found[:, 0].any(), "to a target that is nowhere there is no path"


def test_a_table_counts_on_over_rooms_and_keeps_the_shape_of_what_is_asked() -> None:
    views, table = tiny_room(), ExpertTable()
    table.add_room(views)
    table.add_room(views)
    assert table.rooms == 2
    asked = np.array([[0, 5, 7], [views.graph.views, views.graph.views + 5, 3]])
    found = table.look_up(asked, np.full((2, 3), TARGET))
    assert found.dtype == np.bool_
    np.testing.assert_array_equal(found, shortest_actions(views)[asked % views.graph.views, TARGET])
