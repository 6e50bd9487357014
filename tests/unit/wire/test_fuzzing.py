"""Hostile bytes against the decoders: whatever comes, it is a valid message or a named rejection."""

import random
import tracemalloc
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hoz_dist.wire.protocol.answers import Refused
from hoz_dist.wire.protocol.codec import MESSAGES, PROTOCOL_VERSION, decode, encode
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from tests import wire_samples as samples
from tests.mutations import MUTATIONS, Mutation, encoded, mutated

KINDS = tuple(MESSAGES.values())
VALID = encoded(*samples.MESSAGES, *samples.GRADIENTS.values())
SEED = 20210816


def verdict(data: bytes, *expected: type[Message]) -> str:
    """Return the reason of the rejection; or that the message is valid, which must then survive the wire."""
    try:
        message = decode(data, *expected)
    except RejectedError as error:
        Refused.of(error, 1)  # what is answered can be made, whatever the bytes were
        return error.reason.value
    again = decode(encode(message), *expected)
    assert encode(again) == encode(message)
    return "valid"


def fuzz(count: int, seed: int) -> Counter[str]:
    """Decode mutated messages, each as any kind and as one kind."""
    rng = random.Random(seed)
    verdicts: Counter[str] = Counter()
    for _ in range(count):
        data = mutated(VALID, rng)
        verdicts[verdict(data, *KINDS)] += 1
        verdict(data, rng.choice(KINDS))
    return verdicts


def check(verdicts: Counter[str]) -> None:
    assert verdicts["valid"] < 0.2 * verdicts.total()
    decoders_own = {
        *(Reason.MALFORMED, Reason.VERSION, Reason.KIND, Reason.FIELDS, Reason.TYPE, Reason.SIZE),
        *(Reason.DTYPE, Reason.SHAPE, Reason.NONFINITE, Reason.RANGE, Reason.NAME),
    }
    assert decoders_own <= verdicts.keys(), "each reason that a decoder can have occurs"


def test_mutated_messages_are_valid_or_rejected_by_name() -> None:
    check(fuzz(4000, SEED))


@pytest.mark.long
@pytest.mark.timeout(900)
def test_a_hundred_thousand_mutated_messages_are_valid_or_rejected_by_name() -> None:
    check(fuzz(100_000, SEED + 1))


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_every_mutation_yields_rejections(mutation: Mutation) -> None:
    rng = random.Random(SEED)
    verdicts = Counter(verdict(mutation(rng.choice(VALID), rng.choice(VALID), rng), *KINDS) for _ in range(60))
    assert verdicts.total() - verdicts["valid"] >= 5


@settings(max_examples=300, deadline=None, derandomize=True)
@given(
    st.sampled_from(VALID), st.sampled_from(VALID), st.sampled_from(MUTATIONS), st.integers(), st.binary(max_size=40)
)
def test_mutated_messages_with_strange_bytes_inside_are_valid_or_rejected(
    data: bytes, other: bytes, mutation: Mutation, seed: int, strange: bytes
) -> None:
    rng = random.Random(seed)
    spoilt = mutation(data, other, rng)
    place = rng.randint(0, len(spoilt))
    verdict(spoilt[:place] + strange + spoilt[place:], *KINDS)


def test_what_a_hostile_message_takes_of_memory_is_bounded() -> None:
    tiny = b"\xdc\x0f\xff" + b"\x80" * 4095
    bomb = b"\x83\xa1v" + bytes([PROTOCOL_VERSION]) + b"\xa4kind\xa8gradient\xa5extra\xdc\x0f\xff" + tiny * 4095
    tracemalloc.start()
    assert verdict(bomb, *KINDS) == Reason.SIZE
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(bomb) > 16e6
    assert peak < len(bomb)
