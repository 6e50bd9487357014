"""What an agent knows of its last action: which it was, and whether it failed."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.actions import NO_ACTION, Action

FAILED_MOVE: Final = NO_ACTION + 1
"""Previous action: MoveAhead that left the agent where it was, as something is in the way."""
FAILED_LOOK: Final = NO_ACTION + 2
"""Previous action: LookUp or LookDown that left the camera as it was, as it goes no further."""
PREVIOUS_ACTIONS: Final = NO_ACTION + 3
"""Number of values of a previous action: the six actions, none, and the two failures."""


def felt(actions: NDArray[np.int64], stayed: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return actions as the agent knows them at the next step: whether they failed, too.

    An agent that sees the same picture as before could tell by itself; a robot has bumpers, AI2-THOR
    ``lastActionSuccess``.

    Args:
        actions: Index of an `Action`, [B].
        stayed: Whether the agent sees what it saw before, [B].
    """
    failed = np.where(actions == Action.MOVE_AHEAD, FAILED_MOVE, FAILED_LOOK)
    return np.where(stayed & (actions != Action.DONE), failed, actions)
