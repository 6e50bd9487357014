"""Opens the views of rooms for a learner that learns from rollouts, while it goes on serving."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Final

from hoz_dist.closing import Closing
from hoz_dist.errors import NotFoundError
from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.catalogue import RoomDiffersError
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_store import ViewStore
from learner.checkpoint import Checkpoint
from learner.events import RoomOpened, RoomUnusable

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
        self._news: SimpleQueue[RoomOpened | RoomUnusable] = SimpleQueue()
        self._asked: set[RoomId] = set()
        """Rooms that are, or will be, open."""
        self._due: dict[RoomId, float] = {}
        """When to try rooms again that could not be opened."""
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="hoz opens rooms", daemon=True)
        self._thread.start()

    def want(self, room: RoomId) -> None:
        """Open a room, unless that is under way or done."""
        if room not in self._asked:
            self._asked.add(room)
            self._wanted.put(room)

    def want_those_of(self, checkpoint: Checkpoint) -> None:
        """Open the rooms of a run before this process leads it, so that its actors need not wait for them."""
        for room in checkpoint.rooms:
            self.want(RoomId.parse(room.room))

    def news(self) -> list[RoomOpened | RoomUnusable]:
        """Return what became of rooms since the last call."""
        news = []
        while True:
            try:
                news.append(self._news.get_nowait())
            except Empty:
                return news

    def close(self) -> None:
        """Open no more; what is rendered of a room so far stays in the store."""
        self._closed.set()
        self._wanted.put(None)

    def _run(self) -> None:
        failing: set[RoomId] = set()
        while (room := self._next()) is not None and not self._closed.is_set():
            try:
                views = self._open(room)
            except (RoomDiffersError, NotFoundError) as error:  # as long as this release runs
                _log.warning("cannot open the views of %s, now or later: %s", room, error)
                self._news.put(RoomUnusable(room, str(error)))
            except Exception as error:  # noqa: BLE001 - whatever it is, the other rooms must be opened
                if room not in failing:
                    _log.warning("cannot open the views of %s (%s); its rollouts wait", room, error)
                failing.add(room)
                self._due[room] = time.monotonic() + RETRY_S
            else:
                if room in failing:
                    _log.info("%s is open", room)
                self._news.put(RoomOpened(views))

    def _next(self) -> RoomId | None:
        """Return the next room to open, of those that failed one whose time has come; None to open no more."""
        soonest = min(self._due, key=self._due.__getitem__, default=None)
        try:
            if soonest is None:
                return self._wanted.get()
            return self._wanted.get(timeout=max(self._due[soonest] - time.monotonic(), 0.0))
        except Empty:
            if soonest is not None:
                del self._due[soonest]
            return soonest

    def _open(self, room: RoomId) -> RoomViews:
        views = self._source.store.find(room, self._source.encoder)
        if views is None:
            _log.info("rendering %s to learn from rollouts in it", room)
            self._source.render(room)
            views = self._source.store.open(room, self._source.encoder)
        return views
