"""Messages to bytes and back.

A message is one msgpack map: ``v`` (protocol version), ``kind``, and the fields of the message. Decoding hostile bytes
raises `RejectedError` and nothing else, and allocates no more than a small multiple of their length.
"""

from typing import Final, TypeVar

import msgpack
import xxhash

from hoz_dist.wire.messages import (
    Accepted,
    Busy,
    ConfigReply,
    EpisodesPush,
    GradientPush,
    Message,
    ParametersHead,
    ParametersShard,
    PlanReply,
    Refused,
    RoomGraphPush,
    RoomGraphReply,
    SceneGraphReply,
    StatusReply,
)
from hoz_dist.wire.rejection import Reason, RejectedError
from hoz_dist.wire.schema import MOST_CHARACTERS, MOST_ELEMENTS

PROTOCOL_VERSION: Final = 1
MESSAGES: Final[dict[str, type[Message]]] = {
    message.KIND: message
    for message in (
        GradientPush,
        EpisodesPush,
        RoomGraphPush,
        Accepted,
        Busy,
        Refused,
        ParametersHead,
        ParametersShard,
        ConfigReply,
        SceneGraphReply,
        RoomGraphReply,
        PlanReply,
        StatusReply,
    )
}
"""Every message by its kind."""
_SPARE: Final = 16 * 1024
"""Room for all but the tensors in the buffer that a message is packed into; it grows when that is not enough."""

M = TypeVar("M", bound=Message)


def encode(message: Message) -> bytes:
    """Return the bytes of a message."""
    fields = {"v": PROTOCOL_VERSION, "kind": message.KIND, **message.pack()}
    bulk = sum(_tensor_bytes(value) for value in fields.values())
    # A buffer that has to grow copies a large tensor several times.
    packed: bytes = msgpack.Packer(buf_size=bulk + _SPARE).pack(fields)
    return packed


def decode(data: bytes, *expected: type[M]) -> M:
    """Return the message that the bytes hold.

    Args:
        data: What was received.
        expected: The kinds of message that may stand here.

    Raises:
        RejectedError: The bytes are not one of the expected messages, or a value is not allowed.
    """
    longest = max(message.MOST_BYTES for message in expected)
    if len(data) > longest:
        raise RejectedError(Reason.SIZE, f"the message has {len(data)} bytes, more than {longest}")
    fields = _unpack_map(data)
    version, kind = fields.pop("v", None), fields.pop("kind", None)
    if version != PROTOCOL_VERSION or type(version) is not int:
        detail = f"the message is of protocol version {str(version)[:20]}; this side speaks {PROTOCOL_VERSION}"
        raise RejectedError(Reason.VERSION, detail)
    for message in expected:
        if kind == message.KIND:
            return message.unpack(fields, kind)  # type: ignore[return-value]  # unpack of a subclass makes that subclass
    wanted = " or ".join(message.KIND for message in expected)
    raise RejectedError(Reason.KIND, f"the message is a {str(kind)[:40]!r}, not a {wanted}")


def checksum(data: bytes) -> bytes:
    """Return the checksum that travels with a payload: its xxh3_64, 8 bytes, big-endian."""
    return xxhash.xxh3_64_digest(data)


def _tensor_bytes(packed: object) -> int:
    """Return the length of the raw bytes of a packed field; 0 when it is no tensor."""
    data = packed.get("data") if isinstance(packed, dict) else None
    return data.nbytes if isinstance(data, memoryview) else 0


def _unpack_map(data: bytes) -> dict[object, object]:
    try:
        fields = msgpack.unpackb(
            data,
            max_str_len=4 * MOST_CHARACTERS,  # bytes; a character of UTF-8 has up to four
            max_array_len=MOST_ELEMENTS,
            max_map_len=MOST_ELEMENTS,
            max_bin_len=len(data),
            max_ext_len=0,
        )
    except (ValueError, TypeError, OverflowError, RecursionError, msgpack.UnpackException) as error:
        detail = f"the {len(data)} bytes are not one msgpack map ({type(error).__name__})"
        raise RejectedError(Reason.MALFORMED, detail) from error
    if type(fields) is not dict:
        raise RejectedError(Reason.MALFORMED, f"the message is a {type(fields).__name__}, not a map")
    return fields
