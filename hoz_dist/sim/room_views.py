"""What steps need to know of a room: the views from all its poses, ready for look-up."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.pose_graph import PoseGraph


@dataclass(frozen=True, eq=False)
class RoomViews:
    """All V views of a room as one visual encoder sees them; arrays may be memory-mapped and must not be changed."""

    room: RoomId
    digest: str
    """`Room.digest` of the room that was rendered."""
    graph: PoseGraph
    features: NDArray[np.float16]
    """Feature grids, [V, C, G, G]."""
    detections: NDArray[np.float32]
    """Box (x0, y0, x1, y1) over picture size and confidence of each category, [V, N, 5]; zeros when not seen."""
    appearance: NDArray[np.float16]
    """Average feature under each box, [V, N, C]; zeros when not seen."""
    success: NDArray[np.bool_]
    """Whether Done with that target would succeed, [V, N]."""
    optimal: NDArray[np.int16]
    """L*: least number of actions, Done not counted, to a view that would succeed, [V, N]; -1 when there is none."""
    targets: tuple[int, ...]
    """Indices of the target categories that the room holds."""

    @property
    def bag(self) -> NDArray[np.bool_]:
        """The bag of objects f of every view, [V, N]."""
        return self.detections[..., 4] > 0
