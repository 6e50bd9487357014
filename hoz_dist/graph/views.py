"""Views: what was seen from where."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.pose import VIEWS_PER_POSITION


class Views(NamedTuple):
    """M views (f, l) of a room; of a pose l, zones need only the position."""

    bags: NDArray[np.bool_]
    """f: which categories are seen, [M, N]."""
    positions: NDArray[np.int16]
    """(x, z) in grid units of 0.25 m, [M, 2]."""


def views_at(indices: NDArray[np.int64], bags: NDArray[np.bool_], positions: NDArray[np.int16]) -> Views:
    """Pick views of a room.

    Args:
        indices: View indices, int64 [M].
        bags: Bag of objects of every view of the room, bool [V, N].
        positions: Grid coordinates of every position of the room, int16 [P, 2]; V = 16 P.
    """
    return Views(bags[indices], positions[indices // VIEWS_PER_POSITION])
