import numpy as np

from hoz_dist.nav.actions import NO_ACTION, Action
from hoz_dist.nav.feedback import FAILED_LOOK, FAILED_MOVE, PREVIOUS_ACTIONS, felt


def test_every_previous_action_has_a_value_of_its_own() -> None:
    # A policy's action embedding has a row for each.
    values = [*Action, NO_ACTION, FAILED_MOVE, FAILED_LOOK]
    assert sorted(int(value) for value in values) == list(range(PREVIOUS_ACTIONS))


def test_moves_and_looks_that_change_nothing_are_felt_as_failed() -> None:
    actions = np.array(Action, np.int64)
    assert felt(actions, np.zeros(6, np.bool_)).tolist() == list(Action)
    stayed = felt(actions, np.ones(6, np.bool_)).tolist()
    assert stayed[Action.MOVE_AHEAD] == FAILED_MOVE
    assert stayed[Action.LOOK_UP] == stayed[Action.LOOK_DOWN] == FAILED_LOOK
    assert stayed[Action.DONE] == Action.DONE, "Done never moves the agent"
