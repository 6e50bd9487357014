"""Bulk: the bytes of large tensors stand behind the map of a message, so that nobody copies them to read them.

A message with bulk tensors is its map, zeros up to a multiple of 64 bytes, then the bytes of each bulk tensor in the
order of the fields of its kind, each with zeros up to a multiple of 64. The map has their dtype and shape.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple

from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.schema import Nest, Spec, Tensor, map_of

ALIGNMENT: Final = 64
"""Bytes; that of a cache line, and of the widest vector registers."""


class Layout(NamedTuple):
    """An encoded message whose bulk has not been copied yet."""

    head: bytes
    """The map."""
    bulk: tuple[memoryview, ...]
    """The raw bytes of the bulk tensors, in order."""

    @property
    def size(self) -> int:
        """Length of the encoded message."""
        return sum(map(len, self.parts()))

    def parts(self) -> Iterator[bytes | memoryview]:
        """Give all that the encoded message consists of, one after the other."""
        yield self.head
        if not self.bulk:
            return
        yield bytes(-len(self.head) % ALIGNMENT)
        for data in self.bulk:
            yield data
            yield bytes(-len(data) % ALIGNMENT)

    def write_into(self, buffer: memoryview) -> None:
        """Write the encoded message into a buffer of its length."""
        place = 0
        for part in self.parts():
            buffer[place : place + len(part)] = part
            place += len(part)


class BulkReader:
    """Reads the bulk of a message from its front to its end.

    Args:
        data: The message.
        place: Length of its map.
    """

    def __init__(self, data: bytes, place: int) -> None:
        self._data = data
        self._place = place

    def attach(self, specs: Mapping[str, Spec], fields: dict[str, Any]) -> None:
        """Put the bytes of the bulk tensors into what the map says of them; a field that is missing is left missing.

        Args:
            specs: Specs of the fields.
            fields: The fields; changed.

        Raises:
            RejectedError: A tensor is not described as it should be, or the bytes are not all there.
        """
        for name, spec in specs.items():
            raw = fields.get(name)
            if isinstance(spec, Tensor) and spec.bulk and name in fields:
                description = map_of(raw, Tensor.DESCRIPTION, name)
                fields[name] = description | {"data": self._take(spec.bytes_of(description, name), name)}
            elif type(raw) is dict and isinstance(spec, Nest):
                self.attach(spec.inner(raw), raw)

    def finish(self) -> None:
        """Check that nothing is left.

        Raises:
            RejectedError: There are further bytes.
        """
        if self._place != len(self._data):
            left = len(self._data) - self._place
            raise RejectedError(Reason.MALFORMED, f"{left} bytes stand behind the end of the message")

    def _take(self, size: int, where: str) -> memoryview:
        """Return the bytes of the next tensor."""
        start = self._place + -self._place % ALIGNMENT
        end = start + size
        padded = end + -size % ALIGNMENT
        if padded > len(self._data):
            missing = padded - len(self._data)
            raise RejectedError(Reason.MALFORMED, f"{missing} bytes are missing at the end of {where}")
        if any(self._data[self._place : start]) or any(self._data[end:padded]):
            raise RejectedError(Reason.MALFORMED, f"the bytes beside {where} are not zeros")
        self._place = padded
        return memoryview(self._data)[start:end]
