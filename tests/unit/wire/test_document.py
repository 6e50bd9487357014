"""docs/wire-protocol.md says what the code does."""

import re
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.wire.codec import MESSAGES, PROTOCOL_VERSION, checksum, decode, encode
from hoz_dist.wire.message import Message
from hoz_dist.wire.messages import Accepted, GradientPush, Refused
from hoz_dist.wire.rejection import Reason

DOCUMENT = (Path(__file__).parents[3] / "docs" / "wire-protocol.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    """The text from a heading to the next one."""
    found = re.search(rf"^#+ {re.escape(title)}\n(.*?)(?=^#+ )", DOCUMENT, re.MULTILINE | re.DOTALL)
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


def test_the_examples_are_messages_byte_for_byte() -> None:
    payloads = [bytes.fromhex("".join(block.split())) for block in re.findall(r"```hex\n(.*?)```", DOCUMENT, re.DOTALL)]
    gradient = decode(payloads[0], GradientPush)
    assert (gradient.actor, gradient.incarnation, gradient.sequence) == ("a0", 7, 2)
    assert (gradient.epoch, gradient.version, gradient.frames) == (1, 5, 40)
    np.testing.assert_array_equal(gradient.gradient, [1, -2])
    assert f"`{checksum(payloads[0]).hex()}`" in DOCUMENT
    accepted = decode(payloads[1], Accepted)
    assert (accepted.epoch, accepted.version) == (1, 6)
    refused = decode(payloads[2], Refused)
    assert (refused.reason, refused.detail) == ("stale", "40 versions behind")
    assert [encode(message) for message in (gradient, accepted, refused)] == payloads
