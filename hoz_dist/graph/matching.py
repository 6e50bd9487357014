"""Distance between zones: the matching of two graphs' zones [4.1.2], and the zone that fits what is seen [4.2]."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

ALPHA: Final = 0.1
"""Keeps the distance of zones with nothing in common finite [Eq. 3]."""
Bag = NDArray[np.floating] | NDArray[np.bool_]
"""What is seen, [..., N]: 0 or 1, or a confidence in between."""


def distance(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
    """Compute d(a, b) = ||a - b||_2 + 1 / (a.b + alpha) [Eq. 3], which is always positive.

    In NumPy, as clients that plan have no learning library; `hoz_dist.policy.navigator` has it for agents.

    Args:
        a: Zone nodes or bags of objects, [..., N], not negative.
        b: The same, of a shape that broadcasts with ``a``.

    Returns:
        Distances, [...].
    """
    first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    apart = np.sqrt(np.square(first - second).sum(axis=-1))
    return np.asarray(apart + 1.0 / ((first * second).sum(axis=-1) + ALPHA))


def match(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.int64]:
    """Match zones one to one with the largest sum of weights 1 / d [Eq. 2, Kuhn-Munkres].

    Args:
        a: Zone nodes, [K, N].
        b: Zone nodes, [K, N].

    Returns:
        For each zone of ``a`` the zone of ``b`` that it is matched with, int64 [K].
    """
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415 - clients that only plan start without SciPy

    weights = 1.0 / distance(a[:, None], b[None])  # [K, K]
    _, matched = linear_sum_assignment(weights, maximize=True)
    return matched.astype(np.int64)


def current_zone(nodes: NDArray[np.floating], bag: Bag) -> NDArray[np.int64]:
    """Find the zone that is closest to what is seen, argmin_k d(f_t, delta_k) [4.2, Eq. 3].

    Args:
        nodes: delta, zone nodes, [..., K, N].
        bag: f_t, what is seen, [..., N].

    Returns:
        Zone, int64 [...]; the first one of equals.
    """
    return np.asarray(distance(nodes, np.asarray(bag, dtype=np.float64)[..., None, :]).argmin(axis=-1), dtype=np.int64)
