"""Distance between zones, and the matching of the zones of two graphs [4.1.2]."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

ALPHA: Final = 0.1
"""Keeps the distance of zones with nothing in common finite [Eq. 3]."""


def distance(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
    """Compute d(a, b) = ||a - b||_2 + 1 / (a.b + alpha) [Eq. 3], which is always positive.

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
