"""Payloads are the messages, whichever way their bytes go."""

from dataclasses import replace

import numpy as np
import pytest

from hoz_dist.wire.protocol.codec import checksum, decode, encode, lay_out
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.pushes import GradientPush
from hoz_dist.wire.transport.outgoing import Outgoing
from hoz_dist.wire.transport.shared_memory import LEAST_BYTES, SharedMemory
from tests import wire_samples as samples

pytestmark = pytest.mark.integration

SMALL = samples.gradient_push(0)
LARGE = samples.gradient_push(1, size=300_000)
LARGER = samples.gradient_push(2, size=300_017)


@pytest.mark.parametrize("on", [True, False])
def test_a_payload_is_the_encoded_message_with_its_checksum(on: bool) -> None:
    with SharedMemory(on=on) as memory:
        outgoing = Outgoing(memory)
        for message in (LARGE, LARGER, LARGE, SMALL, samples.MESSAGES[1], LARGE):
            data, attachment = outgoing.payload(lay_out(message))
            assert data.to_bytes() == encode(message)
            assert attachment == checksum(encode(message))
            assert (data.as_shm() is not None) == (on and len(data) >= LEAST_BYTES)


def test_what_was_handed_over_does_not_change_with_the_next_message() -> None:
    messages: list[Message] = [LARGE, replace(LARGE, gradient=np.ones(300_000, np.float32)), LARGER]
    for on in (True, False):
        with SharedMemory(on=on) as memory:
            outgoing = Outgoing(memory)
            payloads = [outgoing.payload(lay_out(message)).data for message in messages]
            assert [payload.to_bytes() for payload in payloads] == [encode(message) for message in messages]


def test_without_room_in_shared_memory_the_bytes_are_the_same() -> None:
    with SharedMemory(on=True, messages=1) as memory:
        outgoing = Outgoing(memory)
        payloads = [outgoing.payload(lay_out(LARGE)) for _ in range(4)]
        assert memory.fallbacks > 0
        for data, attachment in payloads:
            received = data.to_bytes()
            assert checksum(received) == attachment
            np.testing.assert_array_equal(decode(received, GradientPush).gradient, LARGE.gradient)
