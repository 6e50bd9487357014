import pytest

from hoz_dist.wire.protocol.answers import Accepted, Busy
from hoz_dist.wire.protocol.codec import checksum, encode
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.transport.ask import Answer, messages_in

ACCEPTED = encode(Accepted(1, 5))
DAMAGED = ACCEPTED[:-1] + b"\x06"


def test_answers_with_and_without_a_checksum_are_read() -> None:
    answers = [Answer("k", ACCEPTED), Answer("k", ACCEPTED, checksum(ACCEPTED)), Answer("", encode(Busy(1)))]
    assert [message.KIND for message in messages_in(answers, Accepted, Busy)] == ["accepted", "accepted", "busy"]


def test_an_answer_that_was_damaged_on_the_way_is_left_out() -> None:
    damaged = Answer("k", DAMAGED, checksum(ACCEPTED))
    (message,) = messages_in([damaged, Answer("k", ACCEPTED, checksum(ACCEPTED))], Accepted)
    assert message.version == 5
    with pytest.raises(RejectedError) as caught:
        messages_in([damaged], Accepted)
    assert caught.value.reason == Reason.CHECKSUM
