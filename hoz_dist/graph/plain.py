"""Scene graphs as plain values: dictionaries, lists, strings and numbers, as JSON and msgpack have them."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.scene_graph import SceneGraph

_FIELDS: Final = ("scene", "version", "rooms", "categories", "nodes", "edges")
_MAX_NAME: Final = 200
"""Longest name of a scene, room or category, characters."""
_MAX_NAMES: Final = 10_000
"""Most rooms or categories."""


def to_plain(graph: SceneGraph) -> dict[str, Any]:
    """Return ``{"scene", "version", "rooms", "categories": [N], "nodes": [[N] x K], "edges": [[K] x K]}``."""
    return {
        "scene": graph.scene,
        "version": graph.version,
        "rooms": list(graph.rooms),
        "categories": list(graph.categories),
        "nodes": graph.nodes.tolist(),
        "edges": graph.edges.tolist(),
    }


def from_plain(values: object) -> SceneGraph:
    """Read what `to_plain` returned, perhaps by way of a file or the network.

    Raises:
        InvalidValueError: A field is missing, unknown, of the wrong type or out of range.
    """
    if not isinstance(values, dict) or set(values) != set(_FIELDS):
        message = f"A scene graph must have the fields {', '.join(_FIELDS)} and no others."
        raise InvalidValueError(message)
    version = values["version"]
    if type(version) is not int:  # True is an int, too
        message = "The version must be an integer."
        raise InvalidValueError(message)
    return SceneGraph(
        scene=_names("scene", [values["scene"]])[0],
        version=version,
        rooms=_names("rooms", values["rooms"]),
        categories=_names("categories", values["categories"]),
        nodes=_table("nodes", values["nodes"]),
        edges=_table("edges", values["edges"]),
    )


def _names(field: str, values: object) -> tuple[str, ...]:
    """Check a list of names."""
    if (
        not isinstance(values, list)
        or len(values) > _MAX_NAMES
        or not all(isinstance(name, str) and 0 < len(name) <= _MAX_NAME and name.isprintable() for name in values)
    ):
        message = f"In '{field}' there must be printable names of 1 to {_MAX_NAME} characters."
        raise InvalidValueError(message)
    return tuple(values)


def _table(field: str, rows: object) -> NDArray[np.float64]:
    """Check a table of numbers, given as a list of rows of one length."""
    if (
        not isinstance(rows, list)
        or not all(isinstance(row, list) and len(row) == len(rows[0]) for row in rows)
        or not all(type(value) in {float, int} for row in rows for value in row)
    ):
        message = f"In '{field}' there must be rows of numbers, all of one length."
        raise InvalidValueError(message)
    try:
        return np.array(rows, dtype=np.float64)
    except OverflowError as error:
        message = f"In '{field}' a number is too large."
        raise InvalidValueError(message) from error
