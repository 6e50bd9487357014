import numpy as np

from hoz_dist.nav.actions import Action
from hoz_dist.sim.expert import NO_PATH, ExpertTable, expert_actions
from tests.learning.test_learns import TARGET, tiny_room


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


def test_a_table_counts_on_over_rooms_and_keeps_the_shape_of_what_is_asked() -> None:
    views, table = tiny_room(), ExpertTable()
    table.add_room(views)
    table.add_room(views)
    assert table.rooms == 2
    asked = np.array([[0, 5, 7], [views.graph.views, views.graph.views + 5, 3]])
    found = table.look_up(asked, np.full((2, 3), TARGET))
    np.testing.assert_array_equal(found, expert_actions(views)[asked % views.graph.views, TARGET])
