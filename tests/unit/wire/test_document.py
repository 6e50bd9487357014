"""docs/wire-protocol.md says what the code does."""

import re
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from hoz_dist.config import Compression, RunConfig
from hoz_dist.gradient_forms import INT8_BLOCK
from hoz_dist.nav.rooms import RoomId
from hoz_dist.waiting import FIRST_TRY_S, LONGER_TRIES
from hoz_dist.wire.client.epochs import ANOTHER_RUN_S
from hoz_dist.wire.client.parameters import FAST_S, MOST_UNDER_WAY
from hoz_dist.wire.protocol.codec import MESSAGES, PROTOCOL_VERSION, checksum, decode, encode
from hoz_dist.wire.protocol.deltas import Quantised, add
from hoz_dist.wire.protocol.gradients import GradientField
from hoz_dist.wire.protocol.graph_messages import RoomGraphReply, SceneGraphReply
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.message import MAX_PARAMETERS, SHARD_ELEMENTS, SMALL_BYTES, Message
from hoz_dist.wire.protocol.parameters import BLOCK, ParametersDelta, ParametersHead, ParametersShard, digest_of
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.rejections import LOG_EVERY_S, MOST_LINES
from hoz_dist.wire.protocol.run_messages import StatusReply
from hoz_dist.wire.protocol.schema import MOST_CHARACTERS, MOST_ELEMENTS
from hoz_dist.wire.protocol.trajectories import FRAME_BYTES, MAX_ROOMS
from hoz_dist.wire.serving.bases import LONGEST_LIFE
from hoz_dist.wire.serving.inbox import LONGEST_WAIT_S, MOST_WAITING, MOST_WAITING_BYTES
from hoz_dist.wire.serving.versions import EXPIRES_S, HELD_S, MOST_BYTES, MOST_READERS, YIELDS_S
from learner.deduplication import MAX_SENDERS, WINDOW
from tests.wire_examples import BASE, EXAMPLES, GRADIENTS

NUMBERS = ("no", "one", "two", "three", "four")
DOCUMENT = (Path(__file__).parents[3] / "docs" / "wire-protocol.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    """The text from a heading to the next one."""
    found = re.search(rf"^#+ {re.escape(title)}\n(.*?)(?=^#+ |\Z)", DOCUMENT, re.MULTILINE | re.DOTALL)
    assert found is not None, f"no section {title}"
    return found[1]


def test_the_version_is_the_one_documented() -> None:
    assert f"# The wire protocol, version {PROTOCOL_VERSION}\n" in DOCUMENT


@pytest.mark.parametrize("message", MESSAGES.values(), ids=MESSAGES)
def test_every_field_of_every_kind_is_documented(message: type[Message]) -> None:
    text = section(message.KIND)
    referred = "graph, as in `room_graph_push`" in text
    for field in message.SPECS:
        assert f"`{field}`" in text or (referred and f"`{field}`" in section("room_graph_push")), field


def test_every_reason_is_documented_and_no_other() -> None:
    rows = [row.split("|")[1] for row in section("Reasons").splitlines() if row.startswith("| `")]
    assert sorted(re.findall(r"`(\w+)`", " ".join(rows))) == sorted(Reason)


def test_every_kind_has_an_example() -> None:
    assert sorted(example.KIND for example in EXAMPLES) == sorted(MESSAGES)
    assert DOCUMENT.count("```hex") == len(EXAMPLES) + len(GRADIENTS)


def payloads_in(title: str) -> list[bytes]:
    blocks = re.findall(r"```hex\n(.*?)```", section(title), re.DOTALL)
    return [bytes.fromhex("".join(block.split())) for block in blocks]


def check(example: Message, payload: bytes) -> None:
    decoded = decode(payload, type(example))
    assert encode(decoded) == payload
    assert encode(example) == payload, "the example in the document is not this one"


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.KIND)
def test_the_examples_are_messages_byte_for_byte(example: Message) -> None:
    (payload,) = payloads_in(example.KIND)
    check(example, payload)


def test_so_are_those_of_gradients_of_other_codecs() -> None:
    for example, payload in zip(GRADIENTS, payloads_in("Gradients of other codecs"), strict=True):
        check(example, payload)


def test_every_codec_and_its_fields_are_documented() -> None:
    rows = [row.split("|")[1:4] for row in section("gradient").splitlines() if row.startswith("|")]
    codec, told = "", set()
    for named, field, _ in rows[rows.index([" `codec` ", " field ", " type "]) + 2 :]:
        codec = named.strip(" `") or codec
        told.add((codec, field.strip(" `")))
    assert told == {(codec, field) for codec, form in GradientField.FORMS.items() for field in form.fields}
    assert {codec for codec, _ in told} == set(get_args(Compression))
    assert f"a block is {INT8_BLOCK} numbers" in section("gradient")


def test_the_checksum_of_the_gradient_is_the_documented_one() -> None:
    assert f"`{checksum(encode(EXAMPLES[0])).hex()}`" in section("gradient")


def test_the_parameters_of_the_examples_belong_together() -> None:
    head, shard, delta = EXAMPLES[6:9]
    assert isinstance(head, ParametersHead)
    assert isinstance(shard, ParametersShard)
    assert isinstance(delta, ParametersDelta)
    assert head.stamp == shard.head.stamp == delta.head.stamp
    assert f"`{checksum(encode(shard)).hex()}`" in section("shard")
    assert delta.base == digest_of(BASE)
    made = np.empty_like(BASE)
    add(BASE, Quantised(delta.scales, delta.values), made)
    np.testing.assert_array_equal(made, shard.values)


def test_the_documented_limits_are_those_of_the_code() -> None:
    assert f"shards of {SHARD_ELEMENTS:,} values (480 KiB)" in DOCUMENT
    assert f"shards of {ParametersDelta.LENGTH:,} values" in DOCUMENT
    for part in (ParametersShard, ParametersDelta):
        assert f"| {part.LENGTH:,} of them in all shards but the last" in section(part.KIND)
        assert f"At most {part.MOST_BYTES >> 10} KiB." in section(part.KIND)
    assert f"one for each {BLOCK} values" in DOCUMENT
    assert f"at every multiple of {LONGEST_LIFE} versions" in DOCUMENT
    assert f"At most {NUMBERS[MOST_UNDER_WAY]} questions may be" in DOCUMENT
    assert f"longer than {1000 * FAST_S:g} ms" in DOCUMENT
    assert f"{MOST_WAITING} pushes and {MOST_WAITING_BYTES >> 20} MiB wait at the learner" in DOCUMENT
    assert f"one that waits {LONGEST_WAIT_S:g} s" in DOCUMENT
    assert f"for {EXPIRES_S:g} s after the reader got on last" in DOCUMENT
    assert f"did not get on for {YIELDS_S:g} s" in DOCUMENT
    assert f"began {HELD_S:g} s ago" in DOCUMENT
    assert f"at most {MOST_READERS} readers and {MOST_BYTES >> 20} MiB" in DOCUMENT
    assert f"{FIRST_TRY_S:g} s at first" in DOCUMENT
    assert f"up to {LONGER_TRIES * FIRST_TRY_S:g} s" in DOCUMENT
    assert f"{SMALL_BYTES >> 10} KiB, and {Message.MOST_VALUES:,} values" in DOCUMENT
    assert f"{ANOTHER_RUN_S:g} s without the higher one" in DOCUMENT
    assert f"{WINDOW} sequence numbers behind" in DOCUMENT
    assert f"the {MAX_SENDERS} senders" in DOCUMENT
    assert f"first one of each sender and reason in {LOG_EVERY_S:g} s, at most {MOST_LINES} lines" in DOCUMENT


def test_the_documented_bounds_of_messages_are_those_of_the_code() -> None:
    assert f"At most {GradientPush.MOST_BYTES:,} bytes" in section("gradient")
    assert f"P ≤ {MAX_PARAMETERS:,}" in section("gradient")
    assert f"{EpisodesPush.MOST_BYTES >> 10} KiB and {EpisodesPush.MOST_VALUES:,} values" in section("episodes")
    assert f"At most {FRAME_BYTES} B (T + 1) bytes" in section("trajectory")
    assert f"list of at most {MAX_ROOMS} maps" in section("trajectory")
    assert f"At most {StatusReply.MOST_BYTES >> 20} MiB and {StatusReply.MOST_VALUES:,} values" in section("status")
    for graphs in (RoomGraphPush, SceneGraphReply, RoomGraphReply):
        assert f"{graphs.MOST_BYTES >> 20} MiB" in section(graphs.KIND)
    assert f"at most {MOST_ELEMENTS} elements, texts at most {MOST_CHARACTERS} characters" in DOCUMENT


@pytest.mark.parametrize("option", ["batch", "rollout_steps", "gradient_norm", "max_lag", "learn_from", "compress"])
def test_what_of_the_configuration_actors_must_keep_to_is_documented(option: str) -> None:
    assert option in RunConfig().to_json()
    assert option in section("config")


def test_the_documented_keys_are_those_of_the_code() -> None:
    keys = Keys("RUN")
    told = set(re.findall(r"`hoz/\{run\}(/[^`?]*)[^`]*` \|", section("Keys")))
    asked = (keys.config, keys.status, keys.params, keys.shard(0), keys.graph("kitchen"), keys.graph("kitchen/3"))
    pushed = (keys.grads("a"), keys.rollouts("a"), keys.room("a", RoomId("kitchen", 3)))
    made = (*asked, *pushed, keys.plan("kitchen"), keys.alive("r", "i", "h", 4))
    names = {"0": "{shard}", "3": "{number}", "4": "{incarnation}", "kitchen": "{scene}", "a": "{actor}"}
    names |= {"r": "{role}", "i": "{id}", "h": "{host}"}
    assert told == {"/" + "/".join(names.get(part, part) for part in key.split("/")[2:]) for key in made}
