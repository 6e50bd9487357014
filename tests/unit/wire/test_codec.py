"""Every message survives the wire; hostile bytes are rejected by name, and never do anything else."""

import tracemalloc
from contextlib import suppress
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from hoz_dist.config import Compression
from hoz_dist.gradient_forms import Int8Gradient
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.codec import MESSAGES, PROTOCOL_VERSION, checksum, decode, encode
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.run_messages import ConfigReply
from hoz_dist.wire.protocol.schema import Tensor
from tests import wire_samples as samples
from tests.mutations import joined, split

KINDS = tuple(MESSAGES.values())
ALL = (*samples.MESSAGES, *samples.GRADIENTS.values())


def fields_of(message: Message) -> dict[str, Any]:
    return split(encode(message))[0]


def reason_of(data: bytes, *expected: type[Message]) -> Reason:
    with pytest.raises(RejectedError) as caught:
        decode(data, *(expected or KINDS))
    assert caught.value.detail
    return caught.value.reason


def altered(message: Message, **fields: object) -> bytes:
    known, bulk = split(encode(message))
    return joined(known | fields, bulk)


def in_gradient(push: GradientPush, bulk: bytes | None = None, **fields: object) -> bytes:
    """A push with other fields in its gradient, or with other bytes behind its map."""
    known, behind = split(encode(push))
    return joined(known | {"gradient": known["gradient"] | fields}, behind if bulk is None else bulk)


def test_there_is_a_sample_of_every_kind() -> None:
    assert {type(message) for message in samples.MESSAGES} == set(KINDS)


@pytest.mark.parametrize("message", samples.MESSAGES, ids=lambda message: message.KIND)
def test_every_message_survives(message: Message) -> None:
    decoded = decode(encode(message), *KINDS)
    assert type(decoded) is type(message)
    assert encode(decoded) == encode(message)


def test_values_arrive_as_they_were() -> None:
    push = samples.gradient_push(sequence=4)
    decoded = decode(encode(push), GradientPush)
    np.testing.assert_array_equal(decoded.gradient, push.gradient)
    assert (decoded.actor, decoded.incarnation, decoded.sequence, decoded.epoch, decoded.version, decoded.frames) == (
        *("a0", 77, 4),
        *(1, 5, 40),
    )
    episodes = decode(encode(samples.MESSAGES[1]), EpisodesPush).episodes
    assert episodes == (samples.EPISODE, samples.EPISODE)


def test_the_bytes_are_those_of_the_protocol() -> None:
    push = GradientPush("a0", 1, 2, 3, 4, 5, np.array([1.0, -2.0], np.float32))
    data = encode(push)
    fields, bulk = split(data)
    assert fields == {
        "v": PROTOCOL_VERSION,
        "kind": "gradient",
        "actor": "a0",
        "incarnation": 1,
        "sequence": 2,
        "epoch": 3,
        "version": 4,
        "frames": 5,
        "gradient": {"codec": "fp32", "values": {"dtype": "float32", "shape": [2]}},
    }
    assert bulk == bytes.fromhex("0000803f000000c0").ljust(64, b"\0")
    assert len(data) % 64 == 0
    assert checksum(b"").hex() == "2d06800538d394c2"  # XXH3_64 of nothing, as xxHash states it


def test_decoding_a_gradient_does_not_copy_it_again() -> None:
    data = encode(samples.gradient_push())
    decoded = decode(data, GradientPush).gradient
    assert isinstance(decoded, np.ndarray)
    received = np.frombuffer(data, np.uint8)
    assert np.shares_memory(decoded, received)
    assert decoded.ctypes.data - received.ctypes.data == len(data) - 448  # 400 bytes, up to a multiple of 64
    assert not decoded.flags.writeable


def test_decoding_a_large_gradient_takes_hardly_any_memory() -> None:
    data = encode(samples.gradient_push(size=2_000_000))
    tracemalloc.start()
    decode(data, GradientPush)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(data) > 8e6
    assert peak < 0.5e6


@pytest.mark.parametrize("codec", ["bf16", "int8", "topk"])
def test_a_gradient_of_another_form_arrives_as_it_was(codec: Compression) -> None:
    sent = samples.GRADIENTS[codec].gradient
    came = decode(encode(samples.GRADIENTS[codec]), GradientPush).gradient
    assert type(came) is type(sent)
    assert not isinstance(came, np.ndarray)
    for mine, theirs in zip(came, sent, strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_languages_with_one_type_of_number_may_send_whole_numbers() -> None:
    data = altered(samples.MESSAGES[1], value_loss=120)
    assert decode(data, EpisodesPush).value_loss == 120.0


PUSH = samples.gradient_push()
TENSOR = fields_of(PUSH)["gradient"]["values"]
BULK = split(encode(PUSH))[1]
HEAD = encode(PUSH)[: -len(BULK)]
assert HEAD[-1] == 0, "the map is padded"
HALVES = samples.GRADIENTS["bf16"]
LEVELS = samples.GRADIENTS["int8"]
LARGEST = samples.GRADIENTS["topk"]


def of(push: GradientPush, name: str) -> dict[str, Any]:
    tensor: dict[str, Any] = fields_of(push)["gradient"][name]
    return tensor


def padded(*tensors: NDArray[Any]) -> bytes:
    return b"".join(data + bytes(-len(data) % 64) for data in (tensor.tobytes() for tensor in tensors))


def parts_of(push: GradientPush) -> dict[str, NDArray[Any]]:
    assert not isinstance(push.gradient, np.ndarray)
    return {name: value for name, value in push.gradient._asdict().items() if isinstance(value, np.ndarray)}


def refilled(push: GradientPush, **tensors: NDArray[Any]) -> bytes:
    """A push with other elements in tensors of its gradient."""
    return in_gradient(push, padded(*(parts_of(push) | tensors).values()))


ROOM_PUSH = samples.MESSAGES[2]
NODES = fields_of(ROOM_PUSH)["nodes"]


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", Reason.MALFORMED),
        (b"\xc1", Reason.MALFORMED),
        (encode(PUSH)[:-1], Reason.MALFORMED),
        (encode(PUSH) + b"\x00", Reason.MALFORMED),
        (msgpack.packb([1, 2]), Reason.MALFORMED),
        (b"\x81" * 2000, Reason.MALFORMED),
        (b"\x91" * 100_000, Reason.MALFORMED),
        (b"\xdd\xff\xff\xff\xff", Reason.MALFORMED),
        (b"\xdf\xff\xff\xff\xff", Reason.MALFORMED),
        (msgpack.packb({"v": msgpack.ExtType(4, b"x")}), Reason.MALFORMED),
        (msgpack.packb({1: 2}), Reason.MALFORMED),
        (b"\x81\xa1\xff\x01", Reason.MALFORMED),
        (msgpack.packb({}), Reason.VERSION),
        (altered(PUSH, v=1), Reason.VERSION),
        (altered(PUSH, v=True), Reason.VERSION),
        (altered(PUSH, kind="gradients"), Reason.KIND),
        (altered(PUSH, kind=["gradient"]), Reason.KIND),
        (encode(Accepted(1, 2)), Reason.KIND),
        (altered(PUSH, extra=1), Reason.FIELDS),
        (msgpack.packb({"v": PROTOCOL_VERSION, "kind": "gradient"}), Reason.FIELDS),
        (altered(PUSH, frames="40"), Reason.TYPE),
        (altered(PUSH, frames=40.0), Reason.TYPE),
        (altered(PUSH, frames=True), Reason.TYPE),
        (altered(PUSH, frames=None), Reason.TYPE),
        (altered(PUSH, frames=0), Reason.RANGE),
        (altered(PUSH, epoch=-1), Reason.RANGE),
        (altered(PUSH, sequence=2**64 - 1), Reason.RANGE),
        (altered(PUSH, actor="a/b"), Reason.NAME),
        (altered(PUSH, actor="*"), Reason.NAME),
        (altered(PUSH, actor="x" * 65), Reason.SIZE),
        (altered(PUSH, gradient=b"raw"), Reason.TYPE),
        (altered(PUSH, gradient={}), Reason.FIELDS),
        (in_gradient(PUSH, codec="fp8"), Reason.NAME),
        (in_gradient(PUSH, codec=["fp32"]), Reason.TYPE),
        (in_gradient(PUSH, codec="bf16"), Reason.FIELDS),
        (in_gradient(PUSH, size=100), Reason.FIELDS),
        (in_gradient(PUSH, values=BULK), Reason.TYPE),
        (in_gradient(PUSH, values=TENSOR | {"order": "F"}), Reason.FIELDS),
        (in_gradient(PUSH, values=TENSOR | {"data": BULK[:400]}), Reason.FIELDS),
        (in_gradient(PUSH, values=TENSOR | {"dtype": "float64"}), Reason.DTYPE),
        (in_gradient(PUSH, values=TENSOR | {"dtype": "object"}), Reason.DTYPE),
        (in_gradient(PUSH, values=TENSOR | {"dtype": ["f4"]}), Reason.DTYPE),
        (in_gradient(PUSH, values=TENSOR | {"shape": [99]}), Reason.MALFORMED),
        (in_gradient(PUSH, values=TENSOR | {"shape": [200]}), Reason.MALFORMED),
        (in_gradient(PUSH, values=TENSOR | {"shape": [50]}), Reason.MALFORMED),
        (in_gradient(PUSH, values=TENSOR | {"shape": [2**24]}), Reason.MALFORMED),
        (in_gradient(PUSH, values=TENSOR | {"shape": [2**62]}), Reason.SHAPE),
        (in_gradient(PUSH, values=TENSOR | {"shape": [-100]}), Reason.SHAPE),
        (in_gradient(PUSH, values=TENSOR | {"shape": [10, 10]}), Reason.SHAPE),
        (in_gradient(PUSH, values=TENSOR | {"shape": [True]}), Reason.SHAPE),
        (in_gradient(PUSH, values=TENSOR | {"shape": [0]}), Reason.SHAPE),
        (in_gradient(PUSH, BULK + bytes(64)), Reason.MALFORMED),
        (in_gradient(PUSH, BULK[:-64]), Reason.MALFORMED),
        (in_gradient(PUSH, BULK[:400]), Reason.MALFORMED),
        (in_gradient(PUSH, BULK[:-1] + b"\x01"), Reason.MALFORMED),
        (HEAD[:-1] + b"\x01" + BULK, Reason.MALFORMED),
        (HEAD + bytes(64) + BULK, Reason.MALFORMED),
        (in_gradient(PUSH, b""), Reason.MALFORMED),
        (in_gradient(HALVES, halves=of(HALVES, "halves") | {"dtype": "uint16"}), Reason.DTYPE),
        (refilled(LEVELS, levels=np.full(300, -128, "i1")), Reason.RANGE),
        (refilled(LEVELS, scales=np.array([1.0, -1.0], "<f4")), Reason.RANGE),
        (refilled(LEVELS, scales=np.array([1.0, 3e38], "<f4")), Reason.RANGE),
        (refilled(LEVELS, scales=np.array([1.0, np.nan], "<f4")), Reason.NONFINITE),
        (in_gradient(LEVELS, scales=of(LEVELS, "scales") | {"shape": [3]}), Reason.SHAPE),
        (in_gradient(LARGEST, size=0), Reason.RANGE),
        (in_gradient(LARGEST, size=1), Reason.RANGE),
        (in_gradient(LARGEST, size=2**40), Reason.RANGE),
        (in_gradient(LARGEST, size=300.0), Reason.TYPE),
        (refilled(LARGEST, indices=np.array([7, 7, 9], "<u4")), Reason.RANGE),
        (refilled(LARGEST, indices=np.array([9, 8, 7], "<u4")), Reason.RANGE),
        (refilled(LARGEST, indices=np.array([7, 8, 300], "<u4")), Reason.RANGE),
        (in_gradient(LARGEST, halves=of(LARGEST, "halves") | {"shape": [4]}), Reason.SHAPE),
    ],
)
def test_what_is_wrong_with_a_gradient_has_a_name(data: bytes, reason: Reason) -> None:
    assert reason_of(data, GradientPush) == reason


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (altered(ROOM_PUSH, room="kitchen"), Reason.NAME),
        (altered(ROOM_PUSH, room="kitchen/31"), Reason.NAME),
        (altered(ROOM_PUSH, room=3), Reason.TYPE),
        (altered(ROOM_PUSH, digest="d" * 65), Reason.SIZE),
        (altered(ROOM_PUSH, categories=["Sofa"] * 22), Reason.NAME),
        (altered(ROOM_PUSH, categories=["Pan"] * 22), Reason.NAME),
        (altered(ROOM_PUSH, categories=["Pan"]), Reason.SHAPE),
        (altered(ROOM_PUSH, categories=["Pan"] * 23), Reason.SIZE),
        (altered(ROOM_PUSH, categories="Pan"), Reason.TYPE),
        (altered(ROOM_PUSH, nodes=NODES | {"shape": [22, 8]}), Reason.SHAPE),
        (altered(ROOM_PUSH, nodes=NODES | {"shape": [0, 2**63], "data": b""}), Reason.SHAPE),
        (altered(ROOM_PUSH, nodes=NODES | {"shape": [2**64 - 1, 0], "data": b""}), Reason.SHAPE),
        (altered(ROOM_PUSH, nodes=NODES | {"shape": [0, 0], "data": b""}), Reason.SHAPE),
        (altered(ROOM_PUSH, nodes=NODES | {"shape": [2**62, 4]}), Reason.SHAPE),
        (altered(ROOM_PUSH, nodes=NODES | {"data": np.full((8, 22), 1.5).tobytes()}), Reason.RANGE),
        (altered(ROOM_PUSH, nodes=NODES | {"data": np.full((8, 22), -0.1).tobytes()}), Reason.RANGE),
        (altered(ROOM_PUSH, edges=NODES), Reason.SHAPE),
        (altered(ROOM_PUSH, edges={"dtype": "float64", "shape": [8, 8], "data": bytes(512)}), Reason.RANGE),
    ],
)
def test_what_is_wrong_with_a_room_graph_has_a_name(data: bytes, reason: Reason) -> None:
    assert reason_of(data, RoomGraphPush) == reason


@pytest.mark.parametrize(
    ("episode", "reason"),
    [
        (["kitchen/3", 5, True, 9, 4, True], Reason.TYPE),
        ({"room": "kitchen/3"}, Reason.TYPE),
        (["kitchen/99", 5, True, 9, 4, True, 7], Reason.NAME),
        (["kitchen/3", 22, True, 9, 4, True, 7], Reason.RANGE),
        (["kitchen/3", 5, 1, 9, 4, True, 7], Reason.TYPE),
        (["kitchen/3", 5, True, 0, 0, True, 7], Reason.RANGE),
        (["kitchen/3", 5, True, 9, 10, True, 7], Reason.RANGE),
    ],
)
def test_what_is_wrong_with_an_episode_has_a_name(episode: object, reason: Reason) -> None:
    assert reason_of(altered(samples.MESSAGES[1], episodes=[episode]), EpisodesPush) == reason


def test_a_message_longer_than_its_kind_may_be_is_not_even_read() -> None:
    assert reason_of(bytes(Accepted.MOST_BYTES + 1), Accepted) == Reason.SIZE


def test_nothing_may_stand_behind_a_message_without_bulk() -> None:
    assert reason_of(encode(samples.MESSAGES[1]) + bytes(64), EpisodesPush) == Reason.MALFORMED


def test_a_long_list_is_rejected() -> None:
    many = [list(samples.EPISODE)] * 5000
    many = [[str(samples.ROOM), *row[1:]] for row in many]
    assert reason_of(altered(samples.MESSAGES[1], episodes=many), EpisodesPush) == Reason.MALFORMED


CONFIG = samples.config_reply()


@pytest.mark.parametrize(
    ("config", "reason"),
    [
        ([], Reason.TYPE),
        ({"a": b"bytes"}, Reason.TYPE),
        ({"a": float("nan")}, Reason.NONFINITE),
        ({"a": {"b": {"c": {"d": {"e": 1}}}}}, Reason.SIZE),
        ({"a" * 129: 1}, Reason.SIZE),
        ({"a": "x" * 4097}, Reason.SIZE),
    ],
)
def test_what_is_wrong_with_a_configuration_has_a_name(config: object, reason: Reason) -> None:
    assert reason_of(altered(CONFIG, config=config), ConfigReply) == reason


def test_the_longest_text_of_any_script_survives() -> None:
    detail = "\N{GRINNING FACE}" * 2048
    assert decode(encode(Refused("stale", detail)), Refused).detail == detail


def test_invalid_messages_cannot_be_made_to_be_sent() -> None:
    with pytest.raises(RejectedError, match=r"gradient\.scales holds NaN"):
        GradientPush("a0", 1, 0, 1, 1, 1, Int8Gradient(np.zeros(1, np.int8), np.array([np.nan], np.float32)))
    with pytest.raises(RejectedError, match="gradient is float64"):
        GradientPush("a0", 1, 0, 1, 1, 1, np.zeros(3))  # type: ignore[arg-type]
    with pytest.raises(RejectedError, match="actor is not well formed"):
        GradientPush("a b", 1, 0, 1, 1, 1, np.zeros(3, np.float32))


def test_finite_numbers_whose_squares_overflow_are_accepted() -> None:
    huge = np.full(4, 3e38, np.float32)
    push = GradientPush("a0", 1, 0, 1, 1, 1, huge)
    np.testing.assert_array_equal(decode(encode(push), GradientPush).gradient, huge)


def only_rejects(data: bytes, *expected: type[Message]) -> None:
    with suppress(RejectedError):
        decode(data, *expected)


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=300))
def test_arbitrary_bytes_are_decoded_or_rejected(data: bytes) -> None:
    only_rejects(data, *KINDS)


MSGPACK_VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=9),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)


@settings(max_examples=400, deadline=None)
@given(st.data())
def test_messages_with_any_field_replaced_are_decoded_or_rejected(data: st.DataObject) -> None:
    fields, bulk = split(encode(data.draw(st.sampled_from(ALL))))
    name = data.draw(st.sampled_from(sorted(fields)))
    inner = fields[name]
    if isinstance(inner, dict) and inner and data.draw(st.booleans()):
        inner = inner | {data.draw(st.sampled_from(sorted(inner))): data.draw(MSGPACK_VALUES)}
    else:
        inner = data.draw(MSGPACK_VALUES)
    only_rejects(joined(fields | {name: inner}, bulk), *KINDS)


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_damaged_messages_are_decoded_or_rejected(data: st.DataObject) -> None:
    damaged = bytearray(encode(data.draw(st.sampled_from(ALL))))
    for _ in range(data.draw(st.integers(1, 8))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(damaged)))
    only_rejects(bytes(damaged), *KINDS)
    only_rejects(bytes(damaged[:cut]), *KINDS)


def test_a_spec_whose_bounds_could_not_be_judged_cannot_be_made() -> None:
    with pytest.raises(ValueError, match="bfloat16 has no bounds"):
        Tensor("bfloat16", rank=1, most=8, low=0.0, finite=False)
