"""The expert: the actions that begin a shortest path, for every view of a room and every target."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.actions import Action
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.row_table import RowTable

NO_PATH: Final = -1
"""In place of an action where no view can be reached that would succeed."""


def shortest_actions(views: RoomViews) -> NDArray[np.bool_]:
    """Return the actions that begin a shortest path from every view to every target: Done where it would succeed.

    Args:
        views: The room.

    Returns:
        Whether each action does, [V, N, 6]; none does where there is no path.
    """
    here = views.optimal
    actions = np.zeros((*here.shape, len(Action)), bool)
    nearer = here[views.graph.transitions[:, : Action.DONE]] == here[:, np.newaxis] - 1  # [V, 5, N]
    actions[..., : Action.DONE] = nearer.transpose(0, 2, 1) & (here > 0)[..., np.newaxis]
    actions[..., Action.DONE] = here == 0
    return actions


def expert_actions(views: RoomViews) -> NDArray[np.int8]:
    """Return one action for every view and target: the first of those that begin a shortest path.

    Args:
        views: The room.

    Returns:
        Actions, [V, N]; `NO_PATH` where there is none.
    """
    actions = shortest_actions(views)
    first: NDArray[np.int8] = actions.argmax(axis=-1).astype(np.int8)
    first[~actions.any(axis=-1)] = NO_PATH
    return first


class ExpertTable:
    """The expert's actions in rooms; a view's index counts on over the rooms in the order in which they were added."""

    def __init__(self) -> None:
        """Make a table without rooms."""
        self.rooms = 0
        """Number of rooms."""
        self._bits: RowTable[np.uint8] = RowTable()
        """An action's bit is set if it begins a shortest path."""

    def add_room(self, views: RoomViews) -> None:
        """Append the views of a room."""
        self._bits.append(np.packbits(shortest_actions(views), axis=-1, bitorder="little")[..., 0])
        self.rooms += 1

    def look_up(self, views: NDArray[np.int64], targets: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which actions begin a shortest path from views [...] to targets [...], [..., 6]."""
        bits = self._bits.pick(views.ravel(), targets.ravel()).reshape(*views.shape, 1)
        return np.unpackbits(bits, axis=-1, count=len(Action), bitorder="little").astype(bool)
