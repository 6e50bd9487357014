"""How the room graphs of a run become its scene graphs: merged [Alg. 1], or spoilt on purpose, for comparison."""

import zlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph, merge_rooms

GraphSource = Literal["rooms", "random", "random-nodes", "random-edges"]
"""``rooms``: the merge of the rooms. The others hold the same numbers in random places: nodes, edges, or both."""


@dataclass(frozen=True)
class Merging:
    """How to make scene graphs of room graphs; the default is the paper's.

    Attributes:
        order: Seed of the order in which rooms are merged; None for ascending numbers.
        source: Whether the graph tells of the rooms at all.
        seed: Of what is random in it.
    """

    order: int | None = None
    source: GraphSource = "rooms"
    seed: int = 0

    def scene_graph(self, scene: str, rooms: Iterable[RoomGraph], version: int) -> SceneGraph:
        """Make the graph of a scene; the same rooms give the same graph, in whichever order they come.

        Random nodes are a permutation of all entries of delta, random edges one of those between different zones: how
        sparse and how large they are stays as it was, and nothing of what is seen where.

        Args:
            scene: Name of the scene.
            rooms: At least one graph of a room of the scene, all with the same number of zones.
            version: Version of the result.

        Raises:
            InvalidValueError: The rooms cannot be merged; see `merge_rooms`.
            UnknownNameError: There is no such room.
        """
        graph = merge_rooms(scene, rooms, version, order=self.order)
        rng = np.random.default_rng([self.seed, zlib.crc32(scene.encode())])
        if self.source in {"random", "random-nodes"}:
            graph = replace(graph, nodes=rng.permuted(graph.nodes.ravel()).reshape(graph.nodes.shape))
        if self.source in {"random", "random-edges"}:
            graph = replace(graph, edges=_shuffled(graph.edges, rng))
        return graph


def _shuffled(edges: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Permute the edges above the diagonal of a symmetric table, [K, K], and mirror them."""
    shuffled = np.eye(len(edges))
    above = np.triu_indices(len(edges), k=1)
    shuffled[above] = rng.permuted(edges[above])
    shuffled.T[above] = shuffled[above]
    return shuffled
