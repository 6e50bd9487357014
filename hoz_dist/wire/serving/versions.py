"""Which versions of the parameters the learner keeps: the newest, and those that somebody is reading."""

import threading
from collections import OrderedDict
from typing import Final, NamedTuple

from hoz_dist.wire.protocol.parameters import Parameters

MOST_READERS: Final = 1024
MOST_BYTES: Final = 512 * 1024 * 1024
"""Of all versions that are kept, the newest among them."""
EXPIRES_S: Final = 120.0
"""Time after which a reader that asked for nothing more is forgotten; longer than a slow link takes for a shard."""
YIELDS_S: Final = 5.0
"""Time after which such a reader makes room for another one when there is none."""


class _Reading(NamedTuple):
    parameters: Parameters
    time: float
    """When the reader last asked."""


class Versions:
    """The newest version and those being read, each array once; may be used from several threads.

    A reader is begun with the newest version and can then be sure to read all of it. So a slow reader neither gets
    parts of two versions nor has to begin again, however fast the learner is.

    Args:
        most_readers: Largest number of readers.
        most_bytes: Largest number of bytes that are kept for them.
    """

    def __init__(self, most_readers: int = MOST_READERS, most_bytes: int = MOST_BYTES) -> None:
        self._most_readers = most_readers
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._readings: OrderedDict[str, _Reading] = OrderedDict()
        """By reader, the one that asked longest ago first."""
        self.newest: Parameters | None = None

    def begin(self, reader: str, now: float) -> Parameters | None:
        """Return the newest version and keep it for a reader; None when nothing more can be kept.

        Raises:
            LookupError: There are no parameters yet.
        """
        with self._lock:
            newest = self.newest
            if newest is None:
                raise LookupError
            self._readings.pop(reader, None)
            self._expire(now, EXPIRES_S)
            if not self._has_room():
                self._expire(now, YIELDS_S)
            if not self._has_room():
                return None
            self._readings[reader] = _Reading(newest, now)
            return newest

    def go_on(self, reader: str, stamp: tuple[int, int], now: float) -> Parameters | None:
        """Return the version of which a reader has read a part; None when it is not kept any more."""
        with self._lock:
            reading = self._readings.get(reader)
            if reading is not None and reading.parameters.head.stamp == stamp:
                self._readings[reader] = _Reading(reading.parameters, now)
                self._readings.move_to_end(reader)
                return reading.parameters
            newest = self.newest
            return newest if newest is not None and newest.head.stamp == stamp else None

    def end(self, reader: str) -> None:
        """Forget a reader that has read all."""
        with self._lock:
            self._readings.pop(reader, None)

    def kept_bytes(self) -> int:
        """Return the bytes of all versions that are kept."""
        with self._lock:
            return self._bytes()

    def _has_room(self) -> bool:
        return len(self._readings) < self._most_readers and self._bytes() <= self._most_bytes

    def _bytes(self) -> int:
        kept = [reading.parameters for reading in self._readings.values()]
        kept += [self.newest] if self.newest is not None else []
        return sum({one.head.stamp: one.vector.nbytes for one in kept}.values())

    def _expire(self, now: float, after_s: float) -> None:
        while self._readings:
            reader, reading = next(iter(self._readings.items()))
            if now - reading.time < after_s:
                break
            del self._readings[reader]
