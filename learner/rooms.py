"""Opens the views of rooms for a learner that learns from rollouts, while it goes on serving."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Final

from hoz_dist.closing import Closing
from hoz_dist.errors import HozError
from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.nav.rooms import RoomId
from hoz_dist.outage import Outage
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_store import ViewStore

RETRY_S: Final = 5.0
"""Time after which a room that could not be opened is tried again, seconds."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RoomSource:
    """Where the views of rooms come from.

    Attributes:
        store: The view store.
        encoder: The visual encoder of the run.
        render: Puts a room into the store in another process: PyBullet would hold this one up.
    """

    store: ViewStore
    encoder: VisualEncoder
    render: Callable[[RoomId], object]


class RoomOpener(Closing):
    """Opens rooms in a thread of its own, one after the other.

    Args:
        source: Where they come from.
    """

    def __init__(self, source: RoomSource) -> None:
        self._source = source
        self._wanted: SimpleQueue[RoomId | None] = SimpleQueue()
        self._opened: SimpleQueue[RoomViews] = SimpleQueue()
        self._asked: set[RoomId] = set()
        """Rooms that are, or will be, open."""
        self._closed = threading.Event()
        self._outage = Outage(_log, "cannot open the views of a room (%s); its rollouts wait", "rooms are opened again")
        self._thread = threading.Thread(target=self._run, name="hoz opens rooms", daemon=True)
        self._thread.start()

    def want(self, room: RoomId) -> None:
        """Open a room, unless that is under way or done."""
        if room not in self._asked:
            self._asked.add(room)
            self._wanted.put(room)

    def opened(self) -> list[RoomViews]:
        """Return the rooms that were opened since the last call."""
        rooms = []
        while True:
            try:
                rooms.append(self._opened.get_nowait())
            except Empty:
                return rooms

    def close(self) -> None:
        """Open no more; what is rendered of a room so far stays in the store."""
        self._closed.set()
        self._wanted.put(None)

    def _run(self) -> None:
        while (room := self._wanted.get()) is not None and not self._closed.is_set():
            try:
                views = self._source.store.find(room, self._source.encoder)
                if views is None:
                    _log.info("rendering %s to learn from rollouts in it", room)
                    self._source.render(room)
                    views = self._source.store.open(room, self._source.encoder)
            except (HozError, OSError) as error:
                self._outage.failed(error)
                self._closed.wait(RETRY_S)
                self._wanted.put(room)
            else:
                self._outage.worked()
                self._opened.put(views)
