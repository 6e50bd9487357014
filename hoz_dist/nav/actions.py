"""The six actions, in the released order."""

from enum import IntEnum


class Action(IntEnum):
    """What the agent can do in one step; the value is the index in the policy's output."""

    MOVE_AHEAD = 0
    ROTATE_LEFT = 1
    ROTATE_RIGHT = 2
    LOOK_UP = 3
    LOOK_DOWN = 4
    DONE = 5


NO_ACTION = len(Action)
"""Index of "no previous action", used at the first step of an episode."""
