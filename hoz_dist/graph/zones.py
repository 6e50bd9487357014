"""Zones: clusters of views by what is seen [4.1.1]."""

import warnings
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.checks import check_zone_count
from hoz_dist.graph.views import Views

Clustering = Literal["kmeans", "spectral", "agglomerative", "positions", "random"]
"""How views become zones. By their bags: ``kmeans`` (the paper's), ``spectral`` (of their likeness), ``agglomerative``
(Ward's). For comparison: ``positions`` (K-means of where views stand) and ``random`` (each bag in any zone)."""
ZONES: Final = 8
"""K by default, as in the paper."""
_STARTS: Final = 10
"""K-means runs from this many starting points (``n_init``) and keeps the tightest clustering."""

_LIKENESS: Final = 0.5
"""Of two bags that one object tells apart, the likeness is exp(-0.5) under ``spectral``."""


def cluster(views: Views, zones: int, seed: int, clustering: Clustering = "kmeans") -> NDArray[np.int64]:
    """Cluster views into exactly ``zones`` zones, none of them empty.

    K-means runs on the distinct bags, each weighed by its number of views: the same objective as on the views, in
    less time, and it does not depend on the order of the views. When there are fewer distinct bags than zones, each
    bag is a zone, and the zone with the most views is split in two where its views stand until there are enough.
    Positions are clustered in the same way. The other clusterings know no weights: every distinct bag counts once.

    Args:
        views: M views.
        zones: K.
        seed: Of the starting points, 0 <= seed < 2**32. The same views and seed give the same zones.
        clustering: How to cluster.

    Returns:
        Zone of each view, int64 [M].

    Raises:
        InvalidValueError: K is out of range, or there are fewer views than zones.
    """
    check_zone_count(zones)
    count = len(views.bags)
    if count < zones:
        message = f"A room with {count} views cannot have {zones} zones; use at most {count}."
        raise InvalidValueError(message)
    points, point_of_view, views_of_point = np.unique(
        (views.positions if clustering == "positions" else views.bags).astype(np.float64),
        axis=0,
        return_inverse=True,
        return_counts=True,
    )
    if len(points) <= zones:
        zone_of_point = np.arange(len(points))
    elif clustering in {"kmeans", "positions"}:
        zone_of_point = _k_means(points, views_of_point, zones, seed)
    else:
        zone_of_point = _other_clusters(points, zones, seed, clustering)
    # A cluster may be left empty; number the others from 0.
    _, labels = np.unique(zone_of_point[point_of_view], return_inverse=True)
    return _split_until(labels.astype(np.int64), views.positions, zones)


def _k_means(bags: NDArray[np.float64], weights: NDArray[np.int64], zones: int, seed: int) -> NDArray[np.int64]:
    """Return the cluster of each bag, int64 [B], for bags [B, N] that stand for ``weights`` views each."""
    from sklearn.cluster import KMeans  # noqa: PLC0415 - slow to load; only who builds graphs needs it
    from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]  # noqa: PLC0415

    model = KMeans(n_clusters=zones, n_init=_STARTS, random_state=seed)
    # One thread: with several, sums are rounded in the order in which the threads end.
    with threadpool_limits(limits=1), warnings.catch_warnings():
        # Fewer clusters than zones is dealt with by our caller.
        warnings.simplefilter("ignore", ConvergenceWarning)
        labels = model.fit_predict(bags, sample_weight=weights)
    return np.asarray(labels, dtype=np.int64)


def _other_clusters(bags: NDArray[np.float64], zones: int, seed: int, clustering: Clustering) -> NDArray[np.int64]:
    """Return the cluster of each distinct bag of [B, N] by what is not K-means, int64 [B]."""
    if clustering == "random":
        return np.random.default_rng(seed).integers(zones, size=len(bags))
    from sklearn.cluster import AgglomerativeClustering, SpectralClustering  # noqa: PLC0415 - slow to load
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    model = (
        # exp(-0.5 d^2) with d^2 objects that tell two bags apart: never 0, so the graph is connected.
        SpectralClustering(n_clusters=zones, random_state=seed, gamma=_LIKENESS)
        if clustering == "spectral"
        else AgglomerativeClustering(n_clusters=zones)
    )
    with threadpool_limits(limits=1):
        labels = model.fit_predict(bags)
    return np.asarray(labels, dtype=np.int64)


def _split_until(labels: NDArray[np.int64], positions: NDArray[np.int16], zones: int) -> NDArray[np.int64]:
    """Split the largest zone (the first of equals) in two, again and again, until there are ``zones``."""
    labels = labels.copy()
    for new in range(int(labels.max()) + 1, zones):
        members = np.flatnonzero(labels == np.bincount(labels).argmax())
        labels[members[_far_half(positions[members])]] = new
    return labels


def _far_half(positions: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Choose about half of M >= 2 views: those far along the axis on which their positions [M, 2] spread most.

    Views of one position stay together, unless all are of one position.
    """
    spread = np.ptp(positions, axis=0)
    along = positions[:, spread.argmax()]
    if spread.max() == 0:
        return np.arange(len(along)) >= len(along) // 2
    middle = np.median(along)
    far = along >= middle
    return far if not far.all() else along > middle
