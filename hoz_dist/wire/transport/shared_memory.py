"""Shared memory on one host: a large message is copied into it once, and read out of it by every process on its way.

It is off unless wanted: docs/decisions/shared-memory.md says what it gains and what it costs. Both ends and the routers
between them must have it on; whoever has not, or is on another host, gets plain bytes from Zenoh.

A receiver that was paused, or given up for dead, may read what a later message wrote over an earlier one. Whatever is
sent this way needs a checksum; pushes and parameters have one.
"""

import logging
import os
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import zenoh
from zenoh import ZBytes
from zenoh.shm import GarbageCollect, ShmProvider, ZShmMut

from hoz_dist.closing import Closing
from hoz_dist.outage import Outage

_log = logging.getLogger(__name__)
LEAST_BYTES: Final = 128 * 1024
"""Shorter messages are sent as they are: at 64 KiB shared memory gains nothing."""
RESERVE_BYTES: Final = 8 * 1024 * 1024
"""Must stay free beside a pool. Zenoh's own tables take 1.3 MB per process, and it panics when they do not fit."""
_FOLDER: Final = Path("/dev/shm")  # noqa: S108 - where POSIX shared memory is on Linux


class SharedMemory(Closing):
    """Turns payloads into what is handed to Zenoh; may be used from several threads.

    The pool is made for the first large message, and made anew for a larger one. Nothing waits for room in it: sending
    bytes takes milliseconds, waiting for a receiver that was killed takes for ever.

    Args:
        on: Whether to use shared memory, where that is possible.
        messages: So many of the largest messages fit into the pool.

    Attributes:
        on: Whether it is used; the session must be opened accordingly.
        shared: Number of messages that went through shared memory.
        fallbacks: Number of large messages that were sent as bytes although it is on.
    """

    def __init__(self, *, on: bool, messages: int = 3) -> None:
        self.shared = 0
        self.fallbacks = 0
        self._messages = messages
        self._lock = threading.Lock()
        self._pool: ShmProvider | None = None
        self._largest = 0
        self._outage = Outage(_log, "no shared memory (%s); sending bytes", "sending through shared memory again")
        self.on = on and self._has_room(0)

    def gather(self, pieces: Iterable[bytes | bytearray], size: int) -> ZBytes | None:
        """Copy pieces into shared memory, one behind the other.

        Args:
            pieces: What to copy; each is copied before the next one is asked for.
            size: Their length together, bytes.

        Returns:
            What to hand to Zenoh; None, and no piece was asked for, if it must be sent as bytes.
        """
        if not self.on or size < LEAST_BYTES:
            return None
        with self._lock:
            buffer = self._allocated(size)
            if buffer is None:
                self.fallbacks += 1
                return None
            place = 0
            for piece in pieces:
                buffer[place : place + len(piece)] = piece
                place += len(piece)
            self.shared += 1
            self._outage.worked()
            return ZBytes(buffer)

    def close(self) -> None:
        """Let go of the pool, and say how it went."""
        with self._lock:
            self._pool = None
        if self.shared or self.fallbacks:
            _log.info("%d messages went through shared memory, %d did not fit", self.shared, self.fallbacks)

    def _allocated(self, size: int) -> ZShmMut | None:
        """Return room in the pool; None when there is none."""
        try:
            pool = self._pool_for(size)
            # Not the safe way: it never takes back what a killed receiver held (measured).
            return pool.alloc(size, GarbageCollect(safe=False)) if pool is not None else None
        except zenoh.ZError:
            self._outage.failed("the pool is full")
            return None

    def _pool_for(self, size: int) -> ShmProvider | None:
        """Return a pool that is large enough for messages of a size, in bytes; None when there is no room for one."""
        if self._pool is None or size > self._largest:
            # A power of two: few pools are made while messages grow.
            largest = 1 << (size - 1).bit_length()
            if not self._has_room(self._messages * largest):
                return None
            self._pool, self._largest = ShmProvider.default_backend(self._messages * largest), largest
        return self._pool

    def _has_room(self, size: int) -> bool:
        """Tell whether shared memory of a size, in bytes, can be had; Zenoh would fail or panic where it cannot."""
        try:
            state = os.statvfs(_FOLDER)
            free = state.f_bavail * state.f_frsize
            usable = os.access(_FOLDER, os.W_OK) and free >= size + RESERVE_BYTES
        except OSError:
            usable, free = False, 0
        if not usable:
            self._outage.failed(f"{(size + RESERVE_BYTES) / 1e6:.0f} MB of {_FOLDER} are needed, {free / 1e6:.0f} free")
        return usable
