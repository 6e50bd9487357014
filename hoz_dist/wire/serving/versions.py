"""Which versions of the parameters the learner keeps: the newest, and those that somebody is reading."""

import threading
from collections import OrderedDict
from typing import Final, NamedTuple

from hoz_dist.wire.serving.editions import Edition, Full

MOST_READERS: Final = 1024
MOST_BYTES: Final = 512 * 1024 * 1024
"""Of all versions that are kept, the newest among them."""
EXPIRES_S: Final = 120.0
"""Time after which a reader that did not get on is forgotten; longer than a slow link takes for a shard."""
YIELDS_S: Final = 5.0
"""Time after which such a reader makes room for another one when there is none."""
HELD_S: Final = 60.0
"""Time for which a version is kept in any case while its readers get on; then it makes room when there is none."""


class _Reading(NamedTuple):
    edition: Edition
    began: float
    """When the reader asked for the first shard."""
    shard: int
    """The last shard that it asked for."""
    time: float
    """When it asked for that shard for the first time."""

    @property
    def finished(self) -> bool:
        """Whether the reader has asked for all; an answer may be lost, and be asked for once more."""
        return self.shard >= self.edition.shards - 1


class Versions:
    """The newest version and those being read, each array once; may be used from several threads.

    A reader is begun with an edition, of the newest version mostly, and can then read all of it, as long as it gets on
    and there is room. So a slow reader neither gets parts of two versions nor has to begin again, however fast the
    learner is. Who has read all may ask again for what was lost on the way, until it begins anew. When there is no
    room, those who have read all make some first. Nobody can keep the others out: what was held longest makes room.

    Args:
        most_readers: Largest number of readers.
        most_bytes: Largest number of bytes that are kept for them.

    Attributes:
        newest: The newest version; None before there is one.
        besides: What is kept for other reasons than being read.
    """

    def __init__(self, most_readers: int = MOST_READERS, most_bytes: int = MOST_BYTES) -> None:
        self._most_readers = most_readers
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._readings: OrderedDict[str, _Reading] = OrderedDict()
        """By reader, the one that got on longest ago first."""
        self.newest: Full | None = None
        self.besides: tuple[Edition, ...] = ()

    def begin(self, reader: str, edition: Edition, now: float) -> bool:
        """Keep an edition for a reader of its shard 0; False when nothing more can be kept."""
        with self._lock:
            self._expire(now, EXPIRES_S)
            if reader in self._readings and self._readings[reader].finished:
                del self._readings[reader]
            self._drop_the_finished()
            if not self._has_room():
                self._expire(now, YIELDS_S)
            while not self._has_room():
                if not self._drop_the_oldest(now):
                    # Who begins again must not get its own room back before the others had a chance.
                    self._readings.pop(reader, None)
                    return False
            self._readings.pop(reader, None)  # to be the last one
            self._readings[reader] = _Reading(edition, now, 0, now)
            return True

    def go_on(
        self, reader: str, stamp: tuple[int, int], shard: int, now: float, *, deltas: bool = False
    ) -> Edition | None:
        """Return the edition of which a reader has read a part; None when it is not kept any more.

        A shard that it asked for before, or that there is not, does not count as getting on.

        Args:
            reader: Who reads.
            stamp: Epoch and version of the edition.
            shard: Number of the shard that it asks for.
            now: Time, seconds.
            deltas: Whether it reads deltas and their bases. The newest version is then no substitute: a base that was
                made by a delta is not to the bit the version that the learner has.
        """
        with self._lock:
            reading = self._readings.get(reader)
            if reading is not None and reading.edition.head.stamp == stamp:
                if reading.shard < shard < reading.edition.shards:
                    self._readings[reader] = reading._replace(shard=shard, time=now)
                    self._readings.move_to_end(reader)
                return reading.edition
            newest = self.newest
            return newest if not deltas and newest is not None and newest.head.stamp == stamp else None

    def kept_bytes(self) -> int:
        """Return the bytes of all that is kept."""
        with self._lock:
            return self._bytes()

    def _has_room(self) -> bool:
        return len(self._readings) < self._most_readers and self._bytes() <= self._most_bytes

    def _bytes(self) -> int:
        kept = {reading.edition for reading in self._readings.values()} | self._kept_anyway()
        return sum(edition.nbytes for edition in kept)

    def _kept_anyway(self) -> set[Edition]:
        """Return what is kept whether somebody reads it or not."""
        return {*self.besides, *(() if self.newest is None else (self.newest,))}

    def _in_the_way(self) -> list[tuple[str, _Reading]]:
        """Return the readers that make room when they are forgotten, the one that got on longest ago first."""
        if len(self._readings) >= self._most_readers:
            return list(self._readings.items())
        anyway = self._kept_anyway()
        return [(name, one) for name, one in self._readings.items() if one.edition not in anyway]

    def _expire(self, now: float, after_s: float) -> None:
        """Forget the readers that did not get on for so long."""
        while self._readings:
            reader, reading = next(iter(self._readings.items()))
            if now - reading.time < after_s:
                break
            del self._readings[reader]

    def _drop_the_finished(self) -> None:
        """Forget readers that have read all, until there is room."""
        while not self._has_room():
            finished = next((name for name, reading in self._in_the_way() if reading.finished), None)
            if finished is None:
                return
            del self._readings[finished]

    def _drop_the_oldest(self, now: float) -> bool:
        """Forget the readers of the edition that is held longest; False when none is held long enough."""
        readings = (reading for _, reading in self._in_the_way())
        oldest = min(readings, key=lambda reading: reading.began, default=None)
        if oldest is None or now - oldest.began < HELD_S:
            return False
        for reader in [name for name, one in self._readings.items() if one.edition is oldest.edition]:
            del self._readings[reader]
        return True
