"""Messages to bytes and back.

A message is one msgpack map: ``v`` (protocol version), ``kind``, and the fields of the message; and behind it the bytes
of its bulk tensors, if its kind has some. Decoding hostile bytes raises `RejectedError` and nothing else, and allocates
no more than a small multiple of their length: bulk is not copied, and the number of all other values is bounded by the
kind of the message.
"""

from collections.abc import Callable
from typing import Any, Final, TypeVar

import msgpack
import xxhash

from hoz_dist.wire.protocol.answers import Accepted, Busy, Refused
from hoz_dist.wire.protocol.bulk import BulkReader, Layout
from hoz_dist.wire.protocol.graph_messages import PlanReply, RoomGraphReply, SceneGraphReply
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.parameters import ParametersDelta, ParametersHead, ParametersShard
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.rejection import OtherVersionError, Reason, RejectedError, shown
from hoz_dist.wire.protocol.run_messages import ConfigReply, StatusReply
from hoz_dist.wire.protocol.schema import MOST_CHARACTERS, MOST_ELEMENTS, Bulky
from hoz_dist.wire.protocol.trajectories import TrajectoryPush

PROTOCOL_VERSION: Final = 2
MESSAGES: Final[dict[str, type[Message]]] = {
    message.KIND: message
    for message in (
        GradientPush,
        EpisodesPush,
        TrajectoryPush,
        RoomGraphPush,
        Accepted,
        Busy,
        Refused,
        ParametersHead,
        ParametersShard,
        ParametersDelta,
        ConfigReply,
        SceneGraphReply,
        RoomGraphReply,
        PlanReply,
        StatusReply,
    )
}
"""Every message by its kind."""
_VERSION_FIRST: Final = b"\xa1v"
"""The text ``v`` as the first key of a map of up to 15 entries, whose header is one byte."""
_LAST_FIXINT: Final = b"\x7f"
"""Numbers up to this are one byte, their own value."""
_USUAL_BYTES: Final = 16 * 1024
"""Length of the buffer that a message without its bulk is packed into; it grows when that is not enough."""

M = TypeVar("M", bound=Message)


def encode(message: Message) -> bytes:
    """Return the bytes of a message."""
    return b"".join(lay_out(message).parts())


def lay_out(message: Message) -> Layout:
    """Return what the bytes of a message consist of, without copying its bulk."""
    bulk: list[memoryview] = []

    def put_behind(tensor: object) -> object:
        if not isinstance(tensor, Bulky):
            raise TypeError(tensor)
        bulk.append(tensor.data)
        return tensor.description

    fields = {"v": PROTOCOL_VERSION, "kind": message.KIND, **message.pack()}
    head: bytes = msgpack.Packer(buf_size=_USUAL_BYTES, default=put_behind).pack(fields)
    return Layout(head, tuple(bulk))


def decode(data: bytes, *expected: type[M]) -> M:
    """Return the message that the bytes hold.

    Args:
        data: What was received.
        expected: The kinds of message that may stand here.

    Raises:
        RejectedError: The bytes are not one of the expected messages, or a value is not allowed; an
            `OtherVersionError` when they are of another protocol version.
    """
    if data[1:3] == _VERSION_FIRST and b"" < data[3:4] <= _LAST_FIXINT:
        _check_version(int.from_bytes(data[3:4]))  # before all else: what another version looks like is not known
    longest = max(message.MOST_BYTES for message in expected)
    if len(data) > longest:
        raise RejectedError(Reason.SIZE, f"the message has {len(data)} bytes, more than {longest}")
    head = data[: max(message.most_head_bytes() for message in expected)]
    fields, length = _unpack_map(head, max(message.MOST_VALUES for message in expected))
    version, kind = fields.pop("v", None), fields.pop("kind", None)
    _check_version(version)
    for message in expected:
        if kind == message.KIND:
            bulk = BulkReader(data, length)
            if message.BULK:
                bulk.attach(message.SPECS, fields)
            decoded = message.unpack(fields, kind)
            bulk.finish()
            return decoded  # type: ignore[return-value]  # unpack of a subclass makes that subclass
    wanted = " or ".join(message.KIND for message in expected)
    raise RejectedError(Reason.KIND, f"the message is a {shown(kind)}, not a {wanted}")


def checksum(data: bytes | bytearray) -> bytes:
    """Return the checksum that travels with a payload: its xxh3_64, 8 bytes, big-endian."""
    return xxhash.xxh3_64_digest(data)


def _check_version(version: object) -> None:
    """Refuse another protocol version by name.

    Raises:
        OtherVersionError: It is not the one that this side speaks.
    """
    if version != PROTOCOL_VERSION or type(version) is not int:
        raise OtherVersionError(version, PROTOCOL_VERSION)


def _unpack_map(data: bytes, most_values: int) -> tuple[dict[str, Any], int]:
    """Return the map that the bytes begin with, and its length.

    Raises:
        RejectedError: They are something else, hold more than ``most_values`` values, or a key occurs twice.
    """
    left = most_values

    def spend(values: int) -> None:
        # A list of empty maps takes a byte for each, and sixty times as much in memory.
        nonlocal left
        left -= values
        if left < 0:
            raise RejectedError(Reason.SIZE, f"the message holds more than {most_values} values")

    length = len(data)
    try:
        fields = msgpack.unpackb(
            data,
            max_str_len=4 * MOST_CHARACTERS,  # bytes; a character of UTF-8 has up to four
            max_array_len=MOST_ELEMENTS,
            max_map_len=MOST_ELEMENTS,
            max_bin_len=len(data),
            max_ext_len=0,
            object_pairs_hook=lambda pairs: _map_without_repeats(pairs, spend),
            list_hook=lambda values: _counted(values, spend),
        )
    except msgpack.ExtraData as error:
        fields, length = error.unpacked, length - len(error.extra)
    except (ValueError, TypeError, OverflowError, RecursionError, msgpack.UnpackException) as error:
        detail = f"the message does not begin with a msgpack map ({type(error).__name__})"
        raise RejectedError(Reason.MALFORMED, detail) from error
    if type(fields) is not dict:
        raise RejectedError(Reason.MALFORMED, f"the message is a {type(fields).__name__}, not a map")
    return fields, length


def _counted(values: list[object], spend: Callable[[int], None]) -> list[object]:
    spend(1 + len(values))
    return values


def _map_without_repeats(pairs: list[tuple[object, object]], spend: Callable[[int], None]) -> dict[object, object]:
    """Return the map with those entries; readers that disagree on which of two counts must not read two messages."""
    spend(1 + 2 * len(pairs))
    fields = dict(pairs)
    if len(fields) != len(pairs):
        raise RejectedError(Reason.FIELDS, "a map has an entry twice")
    return fields
