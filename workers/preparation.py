"""Gets an actor's rooms ready, one after the other: rendered, explored, and in the environment."""

import random
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from hoz_dist.graph.room_graph import RoomGraph, explore_room
from hoz_dist.graph.zones import Clustering
from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_store import ViewStore


class PreparedRoom(NamedTuple):
    """A room that is ready to train in."""

    views: RoomViews
    graph: RoomGraph


class RoomPreparation:
    """Prepares rooms in an order that follows from the actor's name.

    Actors that share rooms, on one machine, thus begin with different ones, and each finds in the view store what the
    others have rendered meanwhile.
    """

    def __init__(
        self,
        rooms: Sequence[RoomId],
        store: ViewStore,
        encoder: VisualEncoder,
        *,
        zones: int,
        actor: str,
        clustering: Clustering = "kmeans",
    ) -> None:
        """Plan the order; nothing is prepared yet.

        Args:
            rooms: The actor's rooms.
            store: The view store.
            encoder: The visual encoder.
            zones: K.
            actor: Name of the actor.
            clustering: How views become zones.
        """
        shuffled = sorted(rooms)
        random.Random(actor).shuffle(shuffled)
        self._waiting = deque(shuffled)
        self._store = store
        self._encoder = encoder
        self._zones = zones
        self._clustering: Clustering = clustering

    @property
    def waiting(self) -> int:
        """Number of rooms that are not prepared yet."""
        return len(self._waiting)

    def next(self, progress: Callable[[int, int], None] | None = None) -> PreparedRoom:
        """Prepare the next room.

        Args:
            progress: Called with the number of views rendered and of all views of the room. An exception from it ends
                the preparation; the room is then prepared from where it stands by the next call.

        Raises:
            IndexError: All rooms are prepared.
            HozError: The view store cannot be written.
        """
        views = self._store.open(self._waiting[0], self._encoder, progress)
        graph = explore_room(
            str(views.room),
            views.digest,
            transitions=views.graph.transitions,
            positions=views.graph.positions,
            bags=views.bag,
            zones=self._zones,
            clustering=self._clustering,
        )
        self._waiting.popleft()
        return PreparedRoom(views, graph)
