"""The expert: an action of a shortest path, for every view of a room and every target."""

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.actions import Action
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.row_table import RowTable

NO_PATH = -1
"""In place of an action where no view can be reached that would succeed."""


def expert_actions(views: RoomViews) -> NDArray[np.int8]:
    """Return the expert's action for every view and target.

    Done where it would succeed, else the first of the actions that lead one step nearer.

    Args:
        views: The room.

    Returns:
        Actions, [V, N]; `NO_PATH` where there is none.
    """
    here = views.optimal
    nearer = here[views.graph.transitions[:, : Action.DONE]] == here[:, np.newaxis] - 1  # [V, 5, N]
    actions: NDArray[np.int8] = nearer.argmax(axis=1).astype(np.int8)
    actions[here == 0] = Action.DONE
    actions[here < 0] = NO_PATH
    return actions


class ExpertTable:
    """The expert's actions in rooms; a view's index counts on over the rooms in the order in which they were added."""

    def __init__(self) -> None:
        """Make a table without rooms."""
        self.rooms = 0
        """Number of rooms."""
        self._actions: RowTable[np.int8] = RowTable()

    def add_room(self, views: RoomViews) -> None:
        """Append the views of a room."""
        self._actions.append(expert_actions(views))
        self.rooms += 1

    def look_up(self, views: NDArray[np.int64], targets: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the expert's actions at views [...] with targets [...], in their shape; `NO_PATH` where none is."""
        return self._actions.pick(views.ravel(), targets.ravel()).astype(np.int64).reshape(views.shape)
