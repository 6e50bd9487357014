"""Hands encoded messages to Zenoh: as few copies as its Python binding allows, and none into fresh memory.

A large message is copied once into shared memory; without, once into memory that is used again and again, out of which
Zenoh makes its own copy. Memory that comes fresh from the kernel would cost several times as much as the copying.
"""

import threading
from collections.abc import Iterator
from typing import Final, NamedTuple

import xxhash
from zenoh import ZBytes

from hoz_dist.wire.protocol.bulk import Layout
from hoz_dist.wire.protocol.codec import checksum
from hoz_dist.wire.transport.shared_memory import LEAST_BYTES, SharedMemory

_PIECE: Final = 256 * 1024
"""Bytes that are read, summed up and written in one go, so that they are in the cache but the first time."""


class Payload(NamedTuple):
    """What is sent."""

    data: ZBytes
    checksum: bytes


class Outgoing:
    """Turns messages into payloads, one at a time; may be used from several threads.

    Args:
        memory: Shared memory for large messages; it may be off.
    """

    def __init__(self, memory: SharedMemory) -> None:
        self._memory = memory
        self._lock = threading.Lock()
        self._piece = bytearray(_PIECE)
        self._buffer = bytearray()

    def payload(self, layout: Layout) -> Payload:
        """Return the payload of a message; the bulk of the message is read once more each time."""
        size = layout.size
        if size < LEAST_BYTES:
            data = b"".join(layout.parts())
            return Payload(ZBytes(data), checksum(data))
        with self._lock:
            digest = xxhash.xxh3_64()
            shared = self._memory.gather(self._pieces(layout, digest), size)
            if shared is not None:
                return Payload(shared, digest.digest())
            # The memory is used again for equal lengths only, as those of shards are: Zenoh takes it as a whole.
            if len(self._buffer) != size:
                self._buffer = bytearray(size)
            layout.write_into(memoryview(self._buffer))
            return Payload(ZBytes(self._buffer), checksum(self._buffer))

    def _pieces(self, layout: Layout, digest: xxhash.xxh3_64) -> Iterator[bytes | bytearray]:
        """Give the message in pieces of the only types that Zenoh copies from, and sum them up."""
        for part in layout.parts():
            for start in range(0, len(part), _PIECE):
                piece: bytes | bytearray = self._piece
                if len(part) - start >= _PIECE:
                    self._piece[:] = part[start : start + _PIECE]
                else:
                    piece = bytes(part[start:])
                digest.update(piece)
                yield piece
