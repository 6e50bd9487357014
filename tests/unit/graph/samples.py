"""Rooms and graphs that the tests of this package share."""

import numpy as np
from numpy.typing import NDArray

from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.pose import HEADINGS
from hoz_dist.sim.pose_graph import PoseGraph, pose_graph_of


def open_floor(width: int, depth: int) -> PoseGraph:
    """A room of width x depth grid positions without furniture."""
    cells = [(x, z) for x in range(width) for z in range(depth)]
    index = {cell: number for number, cell in enumerate(cells)}
    neighbours = [[index.get((x + dx, z + dz), -1) for dx, dz in HEADINGS] for x, z in cells]
    return pose_graph_of(np.array(cells, dtype=np.int16), np.array(neighbours, dtype=np.int32))


def random_bags(views: int, rng: np.random.Generator, share: float = 0.3) -> NDArray[np.bool_]:
    return rng.random((views, len(TARGETS))) < share


def random_edges(zones: int, rng: np.random.Generator) -> NDArray[np.float64]:
    edges = rng.uniform(0.01, 0.9, (zones, zones))
    edges = np.asarray((edges + edges.T) / 2)
    np.fill_diagonal(edges, 1.0)
    return edges


def random_room_graph(room: str, rng: np.random.Generator, zones: int = 8) -> RoomGraph:
    return RoomGraph(room, "digest", rng.random((zones, len(TARGETS))), random_edges(zones, rng))


def random_scene_graph(seed: int = 0, zones: int = 8, scene: str = "kitchen") -> SceneGraph:
    rng = np.random.default_rng(seed)
    rooms = (f"{scene}/1", f"{scene}/2")
    return SceneGraph(scene, 3, rooms, TARGETS, rng.random((zones, len(TARGETS))), random_edges(zones, rng))
