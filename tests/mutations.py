"""Hostile messages: valid ones that are damaged, cut, stretched, mixed up, or filled with what must not be there.

Every mutation takes encoded valid messages and a random generator, and returns bytes. Most results are invalid; a few
are valid by chance (a changed bit in a number, say), so a test asks the decoder what it says.
"""

import random
import struct
from collections.abc import Callable
from typing import Any, Final

import msgpack

from hoz_dist.wire.protocol.bulk import ALIGNMENT
from hoz_dist.wire.protocol.codec import PROTOCOL_VERSION, encode
from hoz_dist.wire.protocol.message import Message

Mutation = Callable[[bytes, bytes, random.Random], bytes]
"""From a valid message, another valid one, and a generator of random numbers."""

_V: Final = b"\xa1v" + bytes([PROTOCOL_VERSION])
_VERSIONS: Final = (0, 1, 3, 127, 128, -1, 2**63, 1.0, True, None, "1", [1])
_TEXTS: Final = ("", "*", "a/b", "a\nb", "\x00", "x" * 70, "x" * 5000, "kitchen/0", "kitchen/31", "../../etc", "\xe9")
_NUMBERS: Final = (-1, -(2**63), 2**63, 2**64 - 1, float("nan"), float("inf"), float("-inf"), 0.5, 1e308)
_SIMPLE: Final = (*_NUMBERS, None, True, False, 0, "", "a0", "x" * 300, b"", b"abc")


def truncated(data: bytes, _: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def lengthened(data: bytes, other: bytes, rng: random.Random) -> bytes:
    return data + rng.choice((b"\x00", b"\xc1", other, rng.randbytes(rng.randint(1, 64))))


def oversize(data: bytes, _: bytes, rng: random.Random) -> bytes:
    """Longer than any small message may be."""
    return _with(data, lambda fields: fields | {rng.choice(sorted(fields)): bytes(70_000)})


def bits_flipped(data: bytes, _: bytes, rng: random.Random) -> bytes:
    damaged = bytearray(data)
    for _flip in range(rng.choice((1, 1, 1, 2, 8, 64))):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def head_flipped(data: bytes, _: bytes, rng: random.Random) -> bytes:
    """Damaged where the structure is, in front of the bulk."""
    damaged = bytearray(data)
    damaged[rng.randrange(min(len(damaged), 64))] = rng.randrange(256)
    return bytes(damaged)


def spliced(data: bytes, other: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))] + other[rng.randrange(len(other)) :]


def field_missing(data: bytes, _: bytes, rng: random.Random) -> bytes:
    def without(fields: dict[str, Any]) -> dict[str, Any]:
        del fields[rng.choice(sorted(fields))]
        return fields

    return _with(data, without)


def field_added(data: bytes, _: bytes, rng: random.Random) -> bytes:
    name = rng.choice(("extra", "", "v2", "__class__", "gradient\n", "\N{GRINNING FACE}"))
    return _with(data, lambda fields: fields | {name: any_value(rng)})


def field_replaced(data: bytes, _: bytes, rng: random.Random) -> bytes:
    return _with(data, lambda fields: fields | {rng.choice(sorted(fields)): any_value(rng)})


def fields_swapped(data: bytes, other: bytes, rng: random.Random) -> bytes:
    def swapped(fields: dict[str, Any]) -> dict[str, Any]:
        if rng.random() < 0.5:
            first, second = rng.sample(sorted(fields), 2)
            return fields | {first: fields[second], second: fields[first]}
        strange, _ = split(other)
        return fields | {rng.choice(sorted(fields)): strange[rng.choice(sorted(strange))]}

    return _with(data, swapped)


def kind_swapped(data: bytes, other: bytes, _: random.Random) -> bytes:
    return _with(data, lambda fields: fields | {"kind": split(other)[0]["kind"]})


def other_version(data: bytes, _: bytes, rng: random.Random) -> bytes:
    return _with(data, lambda fields: fields | {"v": rng.choice(_VERSIONS)})


def field_twice(data: bytes, _: bytes, rng: random.Random) -> bytes:
    """The same entry in the map two times, which MessagePack can say."""
    fields, bulk = split(data)
    entries = list(fields.items())
    entries.insert(rng.randrange(len(entries) + 1), rng.choice(entries))
    return _map(entries) + bulk


def huge_length(_: bytes, __: bytes, rng: random.Random) -> bytes:
    """Headers that promise gigabytes."""
    header = rng.choice((b"\xdd", b"\xdf", b"\xc6", b"\xdb", b"\xc9"))
    promise = header + struct.pack(">I", rng.choice((2**32 - 1, 2**31, 2**28, 120_000_000)))
    return rng.choice((promise, b"\x83" + _V + b"\xa4kind" + promise, b"\x82" + _V + promise)) + rng.randbytes(20)


def deep(data: bytes, _: bytes, rng: random.Random) -> bytes:
    depth = rng.choice((10, 500, 1023, 1024, 5000))
    nested = rng.choice((b"\x91" * depth + b"\xc0", b"\x81\xa1a" * depth + b"\xc0"))
    entries = [(name, value) for name, value in split(data)[0].items() if name not in {"v", "kind"}]
    name: bytes = msgpack.packb(entries[0][0])
    return b"\x82" + _V + name + nested


def many_values(_: bytes, __: bytes, rng: random.Random) -> bytes:
    """A byte for each value, sixty times as much in memory."""
    row = b"\xdc\x0f\xff" + rng.choice((b"\x80", b"\x90", b"\xa0", b"\xc0")) * 4095
    return b"\x83" + _V + b"\xa4kind\xa8gradient\xa5extra\x92" + row * 2


def bad_number(data: bytes, _: bytes, rng: random.Random) -> bytes:
    """A number out of its range, where a number is."""
    return _with(data, lambda fields: _replace_somewhere(fields, (int, float), rng.choice(_NUMBERS), rng))


def bad_text(data: bytes, _: bytes, rng: random.Random) -> bytes:
    return _with(data, lambda fields: _replace_somewhere(fields, (str,), rng.choice(_TEXTS), rng))


def bad_tensor(data: bytes, _: bytes, rng: random.Random) -> bytes:
    """NaN and infinities, other element types and shapes, bytes too many or too few."""

    def spoil(tensor: dict[str, Any]) -> dict[str, Any]:
        shape, raw = list(tensor["shape"]), tensor["data"]
        width = 8 if tensor["dtype"] == "float64" else 4
        number = struct.pack("<d" if width == 8 else "<f", rng.choice((float("nan"), float("inf"), float("-inf"))))
        place = width * rng.randrange(max(len(raw) // width, 1))
        return tensor | rng.choice(
            (
                {"data": raw[:place] + number + raw[place + width :]},
                {"data": raw[: len(raw) // 2]},
                {"data": raw + bytes(width)},
                {"data": b"", "shape": [0]},
                {"data": b"", "shape": [0, 2**63]},
                {"data": b"", "shape": [2**63, *[0] * (len(shape) - 1)]},
                {"dtype": rng.choice(("float64", "float32", "float16", "int32", "object", ">f4", "", None))},
                {"shape": [*shape[::-1], 1]},
                {"shape": [side + 1 for side in shape]},
                {"shape": [-side for side in shape]},
                {"shape": rng.choice(([], [2**62, 2**62, 0], [True], "3", None, [1.0], [[3]]))},
            )
        )

    return _with(data, lambda fields: {name: spoil(one) if _is_tensor(one) else one for name, one in fields.items()})


def bad_bulk(data: bytes, _: bytes, rng: random.Random) -> bytes:
    """Bytes behind the map that are cut, moved, filled up with other things than zeros, or that nothing tells of."""
    fields, bulk = split(data)
    if not bulk:
        return data + bytes(ALIGNMENT * rng.randint(1, 3))
    place = rng.randrange(len(bulk))
    marked = bulk[:place] + bytes([rng.randrange(1, 256)]) + bulk[place + 1 :]
    spoilt = (marked, bulk[:-1], bulk[:-ALIGNMENT], bulk[1:], bulk + bytes(1), bulk + bytes(ALIGNMENT), bulk * 2, b"")
    return joined(fields, rng.choice(spoilt))


def bad_gradient(data: bytes, other: bytes, rng: random.Random) -> bytes:
    """A gradient whose tensors are described as others than they are, or whose numbers do not fit together."""
    fields, bulk = split(data)
    gradient = fields.get("gradient")
    if not isinstance(gradient, dict):
        return bad_bulk(data, other, rng)
    name = rng.choice([name for name, value in gradient.items() if isinstance(value, dict)])
    tensor = gradient[name]
    number = rng.choice((struct.pack("<f", float("nan")), b"\xff\xff\xff\xff", b"\x80\x7f\x80\x7f", b"\x80" * 4))
    place = 4 * rng.randrange(len(bulk) // 4)
    spoilt: tuple[dict[str, Any], ...] = (
        {"codec": rng.choice(("fp32", "bf16", "int8", "topk", "fp64", "", None))},
        {name: tensor | {"data": bytes(4)}},
        {name: tensor | {"dtype": rng.choice(("float32", "float64", "bfloat16", "int8", "uint32", "", None))}},
        {name: tensor | {"shape": rng.choice(([], [0], [-1], [2**62], [True], [1, 1], [tensor["shape"][0] + 1], 3))}},
        {name: {"dtype": tensor["dtype"]}},
        {"size": rng.choice((0, 1, 2**40, 1.0))},
        {},
    )
    chosen = rng.choice(spoilt)
    if not chosen:
        bulk = bulk[:place] + number + bulk[place + 4 :]
    return joined(fields | {"gradient": gradient | chosen}, bulk)


def random_bytes(_: bytes, __: bytes, rng: random.Random) -> bytes:
    return rng.randbytes(rng.randint(0, 300))


MUTATIONS: Final[tuple[Mutation, ...]] = (
    truncated,
    lengthened,
    oversize,
    bits_flipped,
    head_flipped,
    spliced,
    field_missing,
    field_added,
    field_replaced,
    fields_swapped,
    kind_swapped,
    other_version,
    field_twice,
    huge_length,
    deep,
    many_values,
    bad_number,
    bad_text,
    bad_tensor,
    bad_bulk,
    bad_gradient,
    random_bytes,
)


def mutated(messages: list[bytes], rng: random.Random) -> bytes:
    """Return one of the messages, spoilt in one way."""
    return rng.choice(MUTATIONS)(rng.choice(messages), rng.choice(messages), rng)


def encoded(*messages: Message) -> list[bytes]:
    return [encode(message) for message in messages]


def any_value(rng: random.Random, depth: int = 3) -> Any:
    """Something that MessagePack can hold."""
    if depth == 0 or rng.random() < 0.6:
        return rng.choice(_SIMPLE)
    if rng.random() < 0.5:
        return [any_value(rng, depth - 1) for _ in range(rng.randint(0, 4))]
    return {rng.choice(("a", "dtype", "shape", "data")): any_value(rng, depth - 1) for _ in range(rng.randint(0, 4))}


def split(data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the map of a valid message, and what stands behind it."""
    unpacker = msgpack.Unpacker()
    unpacker.feed(data)
    fields: dict[str, Any] = unpacker.unpack()
    return fields, data[_aligned(unpacker.tell()) :]


def joined(fields: dict[str, Any], bulk: bytes) -> bytes:
    """Return the message with that map, and that behind it."""
    head: bytes = msgpack.packb(fields)
    return head.ljust(_aligned(len(head)), b"\0") + bulk if bulk else head


def _aligned(place: int) -> int:
    return place + -place % ALIGNMENT


def _with(data: bytes, change: Callable[[dict[str, Any]], dict[str, Any]]) -> bytes:
    fields, bulk = split(data)
    return joined(change(fields), bulk)


def _map(entries: list[tuple[str, Any]]) -> bytes:
    packer = msgpack.Packer()
    header: bytes = packer.pack_map_header(len(entries))
    return header + b"".join(msgpack.packb(part) for entry in entries for part in entry)


def _is_tensor(value: Any) -> bool:
    return isinstance(value, dict) and value.keys() == {"dtype", "shape", "data"}


def _replace_somewhere(value: Any, kinds: tuple[type, ...], new: Any, rng: random.Random) -> Any:
    """Replace one value of these types, anywhere inside; nothing when there is none on the way that is taken."""
    if isinstance(value, dict) and value:
        name = rng.choice([name for name in value if name not in {"v", "kind"}] or list(value))
        return value | {name: _replace_somewhere(value[name], kinds, new, rng)}
    if isinstance(value, list) and value:
        index = rng.randrange(len(value))
        return [*value[:index], _replace_somewhere(value[index], kinds, new, rng), *value[index + 1 :]]
    return new if type(value) in kinds else value
