"""Hand-made rooms and views whose right answers are plain to see."""

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.pose import HEADINGS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.pose_graph import PoseGraph, pose_graph_of
from hoz_dist.sim.room import Item, Part, Room, Vector
from hoz_dist.sim.room_views import RoomViews

GREY = (0.6, 0.6, 0.6)
RED = (0.9, 0.1, 0.1)
CHANNELS = 3
GRID = 2


def box(category: str, size: Vector, centre: Vector, colour: Vector = RED) -> Item:
    """Make an item of one box."""
    return Item(category, (Part("box", size, centre, colour),))


def small_room(room: RoomId = RoomId("kitchen", 1)) -> Room:  # noqa: B008 # immutable
    """Make a room of 1.5 m x 3 m with a fridge at its far end and a chair at the other."""
    width, depth = 1.5, 3.0
    walls = Item(
        "Walls",
        (
            Part("box", (width + 0.2, 0.1, 2.5), (width / 2, -0.05, 1.25), GREY),
            Part("box", (width + 0.2, 0.1, 2.5), (width / 2, depth + 0.05, 1.25), GREY),
            Part("box", (0.1, depth, 2.5), (-0.05, depth / 2, 1.25), GREY),
            Part("box", (0.1, depth, 2.5), (width + 0.05, depth / 2, 1.25), GREY),
        ),
    )
    floor = box("Floor", (width, depth, 0.1), (width / 2, depth / 2, -0.05), (0.4, 0.3, 0.2))
    fridge = box("Fridge", (0.6, 0.4, 1.8), (0.75, 2.8, 0.9))
    chair = box("Chair", (0.3, 0.3, 0.9), (0.2, 0.2, 0.45), (0.1, 0.2, 0.9))
    return Room(room, width, depth, (walls, floor, fridge, chair))


def open_grid(width: int, depth: int, holes: frozenset[tuple[int, int]] = frozenset()) -> PoseGraph:
    """Make the pose graph of a rectangle of positions without some."""
    cells = [(x, z) for x in range(width) for z in range(depth) if (x, z) not in holes]
    index = {cell: number for number, cell in enumerate(cells)}
    neighbours = [[index.get((x + dx, z + dz), -1) for dx, dz in HEADINGS] for x, z in cells]
    return pose_graph_of(np.array(cells, dtype=np.int16), np.array(neighbours, dtype=np.int32))


def views_of(graph: PoseGraph, success: NDArray[np.bool_], room: RoomId, seed: int = 0) -> RoomViews:
    """Make views with random sights, in which Done succeeds as given, [V, N]."""
    rng = np.random.default_rng(seed)
    count = len(TARGETS)
    detections = rng.random((graph.views, count, 5), dtype=np.float32)
    detections[..., 4] = detections[..., 4] > 0.5
    return RoomViews(
        room=room,
        digest=f"digest of {room}",
        graph=graph,
        features=rng.random((graph.views, CHANNELS, GRID, GRID)).astype(np.float16),
        detections=detections * detections[..., 4:],
        appearance=rng.random((graph.views, count, CHANNELS)).astype(np.float16),
        success=success,
        optimal=np.stack([graph.distances_to(goal) for goal in success.T], axis=1),
        targets=tuple(np.flatnonzero(success.any(axis=0)).tolist()),
    )


def random_views(room: RoomId, *, seed: int = 0, width: int = 4, depth: int = 5, goals: int = 6) -> RoomViews:
    """Make the views of an open room in which a few random poses succeed for each of three targets."""
    graph = open_grid(width, depth)
    rng = np.random.default_rng(seed)
    success = np.zeros((graph.views, len(TARGETS)), dtype=np.bool_)
    for target in (2, 8, 18):
        success[rng.choice(graph.views, goals, replace=False), target] = True
    return views_of(graph, success, room, seed)
