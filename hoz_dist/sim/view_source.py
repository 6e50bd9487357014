"""Where observations come from: stored views (a look-up), or PyBullet at every step (`hoz_dist.sim.live`)."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hoz_dist.sim.joined_table import JoinedTable
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.row_table import RowTable


class Sight(NamedTuple):
    """What the camera and the encoder show of views; [...] stands for the shape of the view indices."""

    features: NDArray[np.float32]
    """Feature grids, [..., C, G, G]."""
    detections: NDArray[np.float32]
    """Box (x0, y0, x1, y1) over picture size and confidence of each category, [..., N, 5]."""
    appearance: NDArray[np.float32]
    """Average feature under each box, [..., N, C]."""


class ViewSource(Protocol):
    """Shows the views of rooms; a view's index counts on over the rooms in the order in which they were added."""

    def add_room(self, views: RoomViews) -> None:
        """Append the views of a room."""
        ...

    def look(self, views: NDArray[np.int64]) -> Sight:
        """Show what the agent sees at views [...] now."""
        ...

    def succeeds(self, views: NDArray[np.int64], targets: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell whether Done succeeds at views [M], which were looked at last, with targets [M]."""
        ...


class StoredViews:
    """Observations by index look-up in arrays."""

    def __init__(self) -> None:
        """Make a source without rooms."""
        self._sights = JoinedTable()
        self._success: RowTable[np.bool_] = RowTable()

    def add_room(self, views: RoomViews) -> None:
        """Append the views of a room."""
        self._sights.append(views.features, views.detections, views.appearance)
        self._success.append(views.success)

    def look(self, views: NDArray[np.int64]) -> Sight:
        """Look views [...] up."""
        return Sight(*self._sights.take(views))

    def succeeds(self, views: NDArray[np.int64], targets: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Look up whether Done succeeds at views [M] with targets [M]."""
        return self._success.pick(views, targets)
