"""Where the agent is on the graph, and the online update of the graph during an episode [4.2]."""

import numpy as np
from numpy.typing import NDArray

from hoz_dist.graph.matching import distance

Bag = NDArray[np.floating] | NDArray[np.bool_]
"""What is seen, [..., N]: 0 or 1, or a confidence in between."""


def current_zone(nodes: NDArray[np.floating], bag: Bag) -> NDArray[np.int64]:
    """Find the zone that is closest to what is seen, argmin_k d(f_t, delta_k) [4.2, Eq. 3].

    Args:
        nodes: delta, zone nodes, [..., K, N].
        bag: f_t, what is seen, [..., N].

    Returns:
        Zone, int64 [...]; the first one of equals.
    """
    return np.asarray(distance(nodes, np.asarray(bag, dtype=np.float64)[..., None, :]).argmin(axis=-1), dtype=np.int64)


def update(nodes: NDArray[np.float64], bag: Bag, zone: int | NDArray[np.int64], lam: float) -> NDArray[np.float64]:
    """Move the current zone towards what is seen [Eq. 4].

    delta_t = lambda Zc f' + (I - lambda Zc Zc') delta_{t-1}: the row of the current zone becomes
    lambda f + (1 - lambda) delta_c, the others stay.

    Args:
        nodes: delta_{t-1}, [..., K, N]; not changed.
        bag: f_t, [..., N].
        zone: c, the current zone, [...].
        lam: lambda in (0, 1).

    Returns:
        delta_t, [..., K, N].
    """
    indicator = np.asarray(zone)[..., None] == np.arange(nodes.shape[-2])  # Zc, [..., K]
    weight = lam * indicator[..., None].astype(np.float64)
    seen = np.asarray(bag, dtype=np.float64)[..., None, :]
    return np.asarray(weight * seen + (1.0 - weight) * nodes)
