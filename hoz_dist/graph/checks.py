"""What every zone graph must satisfy, wherever it comes from."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError

MAX_ZONES: Final = 64
MAX_CATEGORIES: Final = 1024
_DIAGONAL_TOLERANCE: Final = 1e-6
"""Room for graphs that were once stored as float32."""


def check_zone_count(zones: int) -> None:
    """Check K.

    Raises:
        InvalidValueError: K is out of range.
    """
    if not 1 <= zones <= MAX_ZONES:
        message = f"The number of zones must be 1 to {MAX_ZONES}, not {zones}."
        raise InvalidValueError(message)


def check_zone_graph(nodes: NDArray[np.float64], edges: NDArray[np.float64], categories: int) -> None:
    """Check the nodes and edges of a room graph or a scene graph.

    Args:
        nodes: Zone nodes, float64 [K, N], frequencies in [0, 1].
        edges: Zone edges, float64 [K, K], in [0, 1] with ones on the diagonal.
        categories: N.

    Raises:
        InvalidValueError: Something is off; the message says what.
    """
    check_shapes(nodes, edges, categories)
    check_values(nodes, edges)


def check_shapes(nodes: NDArray[np.float64], edges: NDArray[np.float64], categories: int) -> None:
    """Check that nodes and edges are tables that fit together; see `check_zone_graph`.

    Raises:
        InvalidValueError: They do not.
    """
    zones = len(edges) if edges.ndim else 0
    if not 1 <= zones <= MAX_ZONES or edges.shape != (zones, zones):
        message = f"Edges must be a square table of 1 to {MAX_ZONES} zones, not of shape {edges.shape}."
        raise InvalidValueError(message)
    if nodes.shape != (zones, categories) or not 1 <= categories <= MAX_CATEGORIES:
        message = f"Nodes must be a table of {zones} zones by {categories} categories, not of shape {nodes.shape}."
        raise InvalidValueError(message)


def check_values(nodes: NDArray[np.float64], edges: NDArray[np.float64]) -> None:
    """Check the numbers in tables that `check_shapes` accepts; see `check_zone_graph`.

    Raises:
        InvalidValueError: One is out of its range.
    """
    for name, values in (("Nodes", nodes), ("Edges", edges)):
        if not np.isfinite(values).all() or values.min() < 0 or values.max() > 1:
            message = f"{name} must be finite numbers from 0 to 1."
            raise InvalidValueError(message)
    if np.abs(np.diagonal(edges) - 1).max() > _DIAGONAL_TOLERANCE:
        message = "Edges must be 1 on the diagonal."
        raise InvalidValueError(message)
