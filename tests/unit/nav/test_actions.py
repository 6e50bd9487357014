from hoz_dist.nav.actions import NO_ACTION, Action


def test_actions_keep_the_released_order() -> None:
    # A policy's outputs and stored trajectories are indexed by it.
    assert [action.name for action in Action] == [
        "MOVE_AHEAD",
        "ROTATE_LEFT",
        "ROTATE_RIGHT",
        "LOOK_UP",
        "LOOK_DOWN",
        "DONE",
    ]
    assert [int(action) for action in Action] == list(range(6))


def test_no_action_is_none_of_the_actions() -> None:
    assert NO_ACTION == 6
    assert NO_ACTION not in list(Action)
