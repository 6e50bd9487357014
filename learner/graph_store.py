"""The room graphs that the learner knows, and the scene graphs that follow from them."""

from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph, merge_rooms
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.rejection import Reason, RejectedError

SAME_WITHIN: Final = 1e-6
"""Two graphs of a room are the same when no entry differs by more: machines differ in their last digits."""


class GraphStore:
    """Room graphs by room, and scene graphs rebuilt from them in ascending room number.

    Args:
        zones: K of the run.
        digests: The known digests of rooms; a room that is not among them is known by the first graph that came.
        rooms: The room graphs to begin with.
        versions: Version of each scene graph to begin with.
    """

    def __init__(
        self,
        zones: int,
        digests: Mapping[str, str],
        rooms: Iterable[RoomGraph] = (),
        versions: Mapping[str, int] | None = None,
    ) -> None:
        self._zones = zones
        self._digests = digests
        self._rooms = {room.room: room for room in rooms}
        self._versions = dict(versions or {})
        self._scenes = {scene: self._merge(scene) for scene in self._versions}

    @property
    def rooms(self) -> Mapping[str, RoomGraph]:
        """The known room graphs by room name."""
        return self._rooms

    @property
    def scenes(self) -> Mapping[str, SceneGraph]:
        """The scene graphs by scene."""
        return self._scenes

    @property
    def versions(self) -> Mapping[str, int]:
        """Version of each scene graph: counts its changes."""
        return self._versions

    def add(self, graph: RoomGraph) -> bool:
        """Take a room graph.

        Returns:
            Whether the scene graph changed: not when the room's graph is known already.

        Raises:
            RejectedError: It is not a training room, not of this run's zones, or another graph of the room is known.
        """
        self._check(graph)
        known = self._rooms.get(graph.room)
        if known is not None:
            self._check_same(graph, known)
            return False
        scene = RoomId.parse(graph.room).scene
        self._rooms[graph.room] = graph
        self._versions[scene] = self._versions.get(scene, 0) + 1
        self._scenes[scene] = self._merge(scene)
        return True

    def _merge(self, scene: str) -> SceneGraph:
        rooms = [room for name, room in self._rooms.items() if RoomId.parse(name).scene == scene]
        return merge_rooms(scene, rooms, self._versions[scene])

    def _check(self, graph: RoomGraph) -> None:
        room = RoomId.parse(graph.room)
        if room.split != "train":
            raise RejectedError(Reason.SPLIT, f"{room} is kept for {room.split}")
        if self._digests.get(graph.room, graph.digest) != graph.digest:
            raise RejectedError(Reason.DIGEST, f"{room} has another content than the catalogue says")
        expected = (self._zones, len(TARGETS))
        if graph.nodes.shape != expected:
            raise RejectedError(Reason.SHAPE, f"the nodes of {room} are {graph.nodes.shape}, not {expected}")

    @staticmethod
    def _check_same(graph: RoomGraph, known: RoomGraph) -> None:
        if graph.digest != known.digest:
            raise RejectedError(Reason.DIGEST, f"{graph.room} has another content than before")
        same = all(
            np.allclose(mine, theirs, rtol=0.0, atol=SAME_WITHIN)
            for mine, theirs in ((graph.nodes, known.nodes), (graph.edges, known.edges))
        )
        if not same:
            raise RejectedError(Reason.DIGEST, f"another graph of {graph.room} with this digest is known")
