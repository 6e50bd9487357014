"""Graphs and plans as they travel; frozen, and checked when they are made."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from hoz_dist.graph.checks import MAX_ZONES
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.message import (
    CATEGORIES,
    EDGES,
    GRAPH_BYTES,
    NODES,
    ROOM,
    ROOM_DIGEST,
    SCENE,
    ZONE,
    Served,
    check_graph,
)
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.schema import Int, Many, Real, Structure


@dataclass(frozen=True, eq=False)
class RoomGraphFields(Structure):
    """What a room graph holds, pushed or served.

    Attributes:
        room: The room.
        digest: Digest of the room that was explored.
        categories: [N] names of the columns of ``nodes``.
        nodes: [K, N] f64 zone nodes, in [0, 1].
        edges: [K, K] f64 zone edges, in [0, 1].
    """

    MOST_BYTES: ClassVar[int] = GRAPH_BYTES

    room: Annotated[RoomId, ROOM]
    digest: Annotated[str, ROOM_DIGEST]
    categories: Annotated[tuple[str, ...], CATEGORIES]
    nodes: Annotated[NDArray[np.float64], NODES]
    edges: Annotated[NDArray[np.float64], EDGES]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_graph(self.nodes, self.edges, self.categories)


@dataclass(frozen=True, eq=False)
class SceneGraphReply(Served):
    """A scene graph.

    Attributes:
        scene: The scene.
        version: Number of times that it was rebuilt.
        rooms: Names of the rooms that it merges, in ascending number.
        categories: [N] names of the columns of ``nodes``.
        nodes: [K, N] f64 zone nodes, in [0, 1].
        edges: [K, K] f64 zone edges, in [0, 1].
    """

    KIND: ClassVar[str] = "scene_graph"
    MOST_BYTES: ClassVar[int] = GRAPH_BYTES

    scene: Annotated[str, SCENE]
    version: Annotated[int, Int()]
    rooms: Annotated[tuple[RoomId, ...], Many(ROOM, 1024)]
    categories: Annotated[tuple[str, ...], CATEGORIES]
    nodes: Annotated[NDArray[np.float64], NODES]
    edges: Annotated[NDArray[np.float64], EDGES]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_graph(self.nodes, self.edges, self.categories)
        if any(room.scene != self.scene for room in self.rooms):
            raise RejectedError(Reason.NAME, f"rooms has one that is no {self.scene}")
        if any(first.number >= second.number for first, second in pairwise(self.rooms)):
            raise RejectedError(Reason.RANGE, "rooms is not in ascending number")


@dataclass(frozen=True, eq=False)
class RoomGraphReply(RoomGraphFields, Served):
    """A room graph that the learner serves."""

    KIND: ClassVar[str] = "room_graph"


@dataclass(frozen=True, eq=False)
class PlanReply(Served):
    """A plan on a scene graph; zones are numbered from 0.

    Attributes:
        current: Zone that fits what is seen best.
        target: Zone where the target is likeliest.
        subgoal: Zone to go to next.
        path: Zones from current to target; one zone when they are the same.
        probability: Product of the path's edges.
    """

    KIND: ClassVar[str] = "plan"

    current: Annotated[int, ZONE]
    target: Annotated[int, ZONE]
    subgoal: Annotated[int, ZONE]
    path: Annotated[tuple[int, ...], Many(ZONE, MAX_ZONES)]
    probability: Annotated[float, Real(0.0, 1.0)]

    def __post_init__(self) -> None:
        super().__post_init__()
        ends = self.path[:1] + self.path[-1:]
        if ends != (self.current, self.target) or self.subgoal != self.path[:2][-1]:
            raise RejectedError(Reason.RANGE, "path does not lead from current by subgoal to target")
