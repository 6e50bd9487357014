"""The room graphs that the learner knows, and the scene graphs that follow from them."""

import logging
from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from hoz_dist.graph.merging import Merging
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.rejection import Reason, RejectedError

SAME_WITHIN: Final = 1e-6
"""Two graphs of a room are the same when no entry differs by more: machines differ in their last digits."""

_log = logging.getLogger(__name__)


class GraphStore:
    """Room graphs by room, and scene graphs rebuilt from them in ascending room number.

    Args:
        zones: K of the run.
        digests: The known digests of rooms; a room that is not among them is known by the first graph that came.
        rooms: The room graphs to begin with; those of another content than the known one are left out.
        versions: Version of each scene graph to begin with.
        merging: How scene graphs are made of them.
    """

    def __init__(
        self,
        zones: int,
        digests: Mapping[str, str],
        rooms: Iterable[RoomGraph] = (),
        versions: Mapping[str, int] | None = None,
        merging: Merging = Merging(),  # noqa: B008 - frozen
    ) -> None:
        self._zones = zones
        self._merging = merging
        self._digests = digests
        self._versions = dict(versions or {})
        self._rooms = {room.room: room for room in rooms if self._is_current(room)}
        scenes = {RoomId.parse(room).scene for room in self._rooms}
        self._scenes = {scene: self._merge(scene) for scene in sorted(scenes)}
        self._told: set[str] = set()
        """Rooms of which it was said that their graphs differ."""

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
            RejectedError: It is not a training room, not of this run's zones, or of another content than is known.
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
        return self._merging.scene_graph(scene, rooms, self._versions[scene])

    def _check(self, graph: RoomGraph) -> None:
        room = RoomId.parse(graph.room)
        if room.split != "train":
            raise RejectedError(Reason.SPLIT, f"{room} is kept for {room.split}")
        if not self._has_known_digest(graph):
            raise RejectedError(Reason.DIGEST, f"{room} has another content than the catalogue says")
        expected = (self._zones, len(TARGETS))
        if graph.nodes.shape != expected:
            raise RejectedError(Reason.SHAPE, f"the nodes of {room} are {graph.nodes.shape}, not {expected}")

    def _has_known_digest(self, graph: RoomGraph) -> bool:
        return self._digests.get(graph.room, graph.digest) == graph.digest

    def _is_current(self, room: RoomGraph) -> bool:
        """Tell whether a saved room graph is of the room as it is now; otherwise its scene graph changes."""
        current = self._has_known_digest(room)
        if not current:
            _log.warning("dropped the saved graph of %s: the room has another content now; explore it again", room.room)
            self._versions[RoomId.parse(room.room).scene] += 1
        return current

    def _check_same(self, graph: RoomGraph, known: RoomGraph) -> None:
        """Refuse another content of a room; of one content the first graph stays.

        K-means rounds differently on another processor, and may then end in other zones, which are no worse.
        """
        if graph.digest != known.digest:
            raise RejectedError(Reason.DIGEST, f"{graph.room} has another content than before")
        same = all(
            np.allclose(mine, theirs, rtol=0.0, atol=SAME_WITHIN)
            for mine, theirs in ((graph.nodes, known.nodes), (graph.edges, known.edges))
        )
        if not same and graph.room not in self._told:
            self._told.add(graph.room)
            _log.info("an actor's graph of %s differs from the one that is known; the first is kept", graph.room)
