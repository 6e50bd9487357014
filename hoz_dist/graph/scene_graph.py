"""The scene graph: the merge of the graphs of a scene's rooms [4.1.2, Alg. 1]."""

import random
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.graph.checks import check_zone_graph
from hoz_dist.graph.matching import match
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId


@dataclass(frozen=True, eq=False)
class SceneGraph:
    """K zones of a scene. Nodes and edges of any float type become float64.

    Raises:
        InvalidValueError: Nodes and edges are not those of a zone graph, or the version or the categories are off.
    """

    scene: str
    version: int
    """Counts the changes of the graph in a run; 0 for a graph that belongs to none."""
    rooms: tuple[str, ...]
    """Names of the rooms that were merged, in ascending number; empty when not known (released graphs)."""
    categories: tuple[str, ...]
    """Names of the N categories."""
    nodes: NDArray[np.float64]
    """delta(v_k): how often each category is seen in each zone, [K, N], in [0, 1]."""
    edges: NDArray[np.float64]
    """e(k, j): how close zones are, [K, K], in [0, 1], 1 on the diagonal."""

    def __post_init__(self) -> None:
        """Convert and check."""
        if self.version < 0:
            message = f"The version of a scene graph must not be negative, but is {self.version}."
            raise InvalidValueError(message)
        if len({name.lower() for name in self.categories}) != len(self.categories):
            message = "Categories must differ from each other."
            raise InvalidValueError(message)
        object.__setattr__(self, "nodes", np.array(self.nodes, dtype=np.float64))
        object.__setattr__(self, "edges", np.array(self.edges, dtype=np.float64))
        check_zone_graph(self.nodes, self.edges, len(self.categories))

    @property
    def zones(self) -> int:
        """K."""
        return len(self.nodes)

    def category(self, name: str) -> int:
        """Return the index of a category of this graph; upper and lower case are the same.

        Raises:
            UnknownNameError: The graph has no such category.
        """
        for index, known in enumerate(self.categories):
            if known.lower() == name.lower():
                return index
        raise UnknownNameError.of("category", name, self.categories)

    def bag(self, names: Iterable[str]) -> NDArray[np.float64]:
        """Return the bag of objects f in {0, 1}^N that holds these categories.

        Raises:
            UnknownNameError: The graph has no such category.
        """
        bag = np.zeros(len(self.categories))
        bag[[self.category(name) for name in names]] = 1.0
        return bag


def top_objects(graph: SceneGraph, zone: int, count: int) -> list[tuple[str, float]]:
    """Return the categories seen most often in a zone with their frequencies in (0, 1], most frequent first."""
    order = np.argsort(-graph.nodes[zone], kind="stable")[:count]
    return [(graph.categories[index], float(graph.nodes[zone, index])) for index in order if graph.nodes[zone, index]]


def merge_rooms(
    scene: str,
    rooms: Iterable[RoomGraph],
    version: int,
    categories: tuple[str, ...] = TARGETS,
    order: int | None = None,
) -> SceneGraph:
    """Merge room graphs into the graph of their scene [Alg. 1].

    Each next room is matched with the merge so far and enters a running mean, so that after n rooms each weighs 1/n.
    The rooms are taken in ascending number, in whichever order they come. The released code matches room i with
    room i + 1 instead, so that its last rooms weigh most.

    Args:
        scene: Name of the scene.
        rooms: At least one graph of a room of the scene, all with the same number of zones.
        version: Version of the result.
        categories: Names of the categories.
        order: Seed of another order to take the rooms in; rooms that come later leave the order of the others as it is.

    Raises:
        InvalidValueError: There is no room, a room comes twice or is of another scene, or shapes differ.
        UnknownNameError: There is no such room.
    """
    ordered = sorted(rooms, key=lambda graph: RoomId.parse(graph.room).number)
    _check_mergeable(scene, ordered)
    names = tuple(graph.room for graph in ordered)
    if order is not None:
        ordered.sort(key=lambda graph: random.Random(f"merge {order} {graph.room}").random())
    nodes, edges = ordered[0].nodes.copy(), ordered[0].edges.copy()
    for count, room in enumerate(ordered[1:], start=2):
        matched = match(nodes, room.nodes)
        nodes += (room.nodes[matched] - nodes) / count
        edges += (room.edges[np.ix_(matched, matched)] - edges) / count
    return SceneGraph(scene, version, names, categories, nodes, edges)


def _check_mergeable(scene: str, rooms: list[RoomGraph]) -> None:
    """Raise InvalidValueError unless the rooms can be merged."""
    if not rooms:
        message = f"There is no graph of a room of '{scene}' to merge."
        raise InvalidValueError(message)
    names = [graph.room for graph in rooms]
    for name in names:
        if RoomId.parse(name).scene != scene:
            message = f"Room {name} cannot be merged into the graph of scene '{scene}'."
            raise InvalidValueError(message)
        if names.count(name) > 1:
            message = f"Room {name} cannot be merged twice."
            raise InvalidValueError(message)
    shapes = {graph.nodes.shape for graph in rooms}
    if len(shapes) > 1:
        message = f"Graphs of rooms with different numbers of zones or categories cannot be merged: {sorted(shapes)}."
        raise InvalidValueError(message)
