"""Scene graphs in the released format: MATLAB 5 files with ``node_features`` (K, N) and ``edges`` (K, K)."""

import io
from pathlib import Path
from typing import Any, Final

from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.mat5 import read_mat5
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import SCENES, TARGETS

_TABLES: Final = ("node_features", "edges")


def to_matlab(graph: SceneGraph) -> bytes:
    """Return the content of a ``.mat`` file, which has no place for the names of scene, rooms and categories.

    Raises:
        InvalidValueError: The categories are not the 22 targets, which the format takes for granted.
    """
    from scipy.io import savemat  # noqa: PLC0415 - clients start without SciPy

    if graph.categories != TARGETS:
        message = f"A .mat file can only hold a graph of the {len(TARGETS)} targets in their usual order; use .json."
        raise InvalidValueError(message)
    file: Any = io.BytesIO()  # Any: the stubs know only paths
    savemat(file, dict(zip(_TABLES, (graph.nodes, graph.edges), strict=True)))
    content: bytes = file.getvalue()
    return content


def from_matlab(content: bytes, scene: str) -> SceneGraph:
    """Read the content of a ``.mat`` file.

    Args:
        content: Of the file.
        scene: Name of the scene, which the file does not hold.

    Returns:
        The graph, of version 0 and no rooms, since the file does not hold these either.

    Raises:
        InvalidValueError: The content is not that of a scene graph; the message says what is wrong.
    """
    tables = read_mat5(content, _TABLES)
    if not all(name in tables for name in _TABLES):
        message = "It must hold the tables 'node_features' and 'edges' of real doubles."
        raise InvalidValueError(message)
    nodes, edges = (tables[name] for name in _TABLES)
    return SceneGraph(scene=scene, version=0, rooms=(), categories=TARGETS, nodes=nodes, edges=edges)


def scene_of_file(path: Path) -> str:
    """Guess the scene of a ``.mat`` file from its name: ``Living_Rooms.mat`` is ``living_room``.

    Returns:
        A scene, or the file's stem when it names none.
    """
    letters = path.stem.lower().rstrip("s").translate(str.maketrans("", "", "_- "))
    return next((scene for scene in SCENES if scene.replace("_", "") == letters), path.stem)
