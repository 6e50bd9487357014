"""Pushes that are taken, refused, repeated or put off."""

import threading
import time
from collections.abc import Iterator

import pytest

from hoz_dist.errors import ConnectionFailedError
from hoz_dist.waiting import StoppedError
from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.protocol.answers import Accepted, Busy, PushReply, Refused
from hoz_dist.wire.protocol.codec import decode, encode
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.serving.inbox import Inbox
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.transport.session import Session, open_client
from tests import wire_samples as samples
from tests.integration.wire.pushing import GRADS, WAIT_S, answering, encoded_gradient, push_to, raw_push, taken, until

pytestmark = pytest.mark.integration


def test_a_push_arrives_and_is_acknowledged(learner: Server, client: Session) -> None:
    push = samples.gradient_push()
    with answering(learner.inbox, lambda _: Accepted(1, 6)) as came:
        reply = push_to(client, push)
    assert isinstance(reply, Accepted)
    assert (reply.epoch, reply.version) == (1, 6)
    assert len(came) == 1
    assert encode(came[0]) == encode(push)


def test_a_busy_learner_is_asked_again_until_it_takes_the_push(learner: Server, client: Session) -> None:
    replies: Iterator[PushReply] = iter([Busy(1), Busy(1), Accepted(1, 6)])
    with answering(learner.inbox, lambda _: next(replies)) as came:
        assert isinstance(push_to(client, samples.gradient_push(3)), Accepted)
    assert [push.sequence for push in came] == [3, 3, 3]


def test_a_refused_push_is_counted_and_not_repeated(learner: Server, client: Session) -> None:
    with answering(learner.inbox, lambda _: Refused(Reason.STALE, "too old", 1)) as came:
        reply = push_to(client, samples.gradient_push())
    assert isinstance(reply, Refused)
    assert (reply.reason, reply.detail) == ("stale", "too old")
    assert len(came) == 1
    assert learner.rejections.by_reason() == {"stale": 1}
    assert learner.rejections.by_sender() == {"a0": 1}


def test_the_end_of_a_run_is_no_rejection(learner: Server, client: Session) -> None:
    with answering(learner.inbox, lambda _: Refused(Reason.FINISHED, "the budget is used up", 1)):
        assert isinstance(push_to(client, samples.gradient_push()), Refused)
    assert learner.rejections.by_reason() == {}


def test_an_unanswered_push_is_sent_again_with_the_same_identity(learner: Server, client: Session) -> None:
    push = samples.gradient_push(sequence=8)
    replies: list[PushReply] = []
    pusher = Pusher(client, threading.Event(), attempt_s=0.2)
    thread = threading.Thread(target=lambda: replies.append(pusher.push(GRADS, push)))
    thread.start()
    first = taken(learner.inbox)  # held: the learner computes for longer than an attempt lasts
    second = taken(learner.inbox)
    first.answer(Accepted(1, 6))  # too late, nobody listens
    second.answer(Accepted(1, 6))
    thread.join(WAIT_S)
    assert isinstance(replies[0], Accepted)
    identities = {(p.message.actor, p.message.incarnation, p.message.sequence) for p in (first, second)}
    assert identities == {("a0", 77, 8)}


def test_a_request_can_be_answered_once_only(learner: Server, client: Session) -> None:
    with answering(learner.inbox, lambda _: Accepted(1, 1)):
        push_to(client, samples.gradient_push())
    answers = []
    thread = threading.Thread(target=lambda: answers.extend(raw_push(client, GRADS, encode(samples.gradient_push()))))
    thread.start()
    request = taken(learner.inbox)
    request.answer(Accepted(1, 2))
    request.answer(Refused(Reason.STALE, "again"))
    thread.join(WAIT_S)
    assert [decode(answer, Accepted).version for answer in answers] == [2]
    assert learner.rejections.by_reason() == {}


def test_a_stopped_process_does_not_wait_for_its_push(learner: Server, client: Session) -> None:
    stop = threading.Event()
    caught: list[BaseException] = []

    def push() -> None:
        try:
            Pusher(client, stop).push(GRADS, samples.gradient_push())
        except StoppedError as error:
            caught.append(error)

    thread = threading.Thread(target=push)
    thread.start()
    taken(learner.inbox)
    began = time.monotonic()
    stop.set()
    thread.join(WAIT_S)
    assert caught
    assert time.monotonic() - began < 0.5


def test_a_push_gives_up_at_its_deadline(learner: Server, client: Session) -> None:
    with answering(learner.inbox, lambda _: Busy(1)), pytest.raises(ConnectionFailedError, match=r"within 0\.3 s"):
        Pusher(client, threading.Event()).push(GRADS, samples.gradient_push(), deadline_s=0.3)


def test_a_full_inbox_makes_the_learner_busy_at_once(endpoint: str) -> None:
    inbox = Inbox(most=2)
    with samples.serving(endpoint, inbox=inbox) as (server, _), open_client(endpoint) as session:
        waiting = [threading.Thread(target=raw_push, args=(session, GRADS, encoded_gradient(n))) for n in range(2)]
        for thread in waiting:
            thread.start()
        assert until(lambda: len(inbox) == 2)
        (answer,) = raw_push(session, GRADS, encoded_gradient(2))
        assert isinstance(decode(answer, Busy), Busy)
        for _ in range(2):
            taken(inbox).answer(Accepted(1, 1))
        for thread in waiting:
            thread.join(WAIT_S)
    assert server.rejections.by_reason() == {}


def test_an_inbox_is_bounded_by_bytes_too(endpoint: str) -> None:
    inbox = Inbox(most_bytes=1000)
    with samples.serving(endpoint, inbox=inbox), open_client(endpoint) as session:
        first = threading.Thread(target=raw_push, args=(session, GRADS, encoded_gradient(0, size=2000)))
        first.start()
        assert until(lambda: len(inbox) == 1), "one message may always wait, however long"
        (answer,) = raw_push(session, GRADS, encoded_gradient(1, size=10))
        assert isinstance(decode(answer, Busy), Busy)
        taken(inbox).answer(Accepted(1, 1))
        first.join(WAIT_S)
        with answering(inbox, lambda _: Accepted(1, 1)):
            for sequence in range(10):  # together more than may wait; what was taken out makes room
                assert isinstance(push_to(session, samples.gradient_push(sequence)), Accepted)
        small = [
            threading.Thread(target=raw_push, args=(session, GRADS, encoded_gradient(n, size=10))) for n in range(2)
        ]
        for thread in small:
            thread.start()
        assert until(lambda: len(inbox) == 2)
        for _ in small:
            taken(inbox).answer(Accepted(1, 1))
        for thread in small:
            thread.join(WAIT_S)
