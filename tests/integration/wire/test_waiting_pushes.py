"""Pushes that wait for a learner that is slow or stuck: few wait, none for long, and each counts once."""

import threading
import time
from collections import Counter
from contextlib import ExitStack

import pytest

from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.protocol.answers import Accepted, Busy, PushReply
from hoz_dist.wire.protocol.codec import decode
from hoz_dist.wire.serving.inbox import MOST_WAITING, Inbox
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.transport.session import Session, open_client
from tests import wire_samples as samples
from tests.integration.wire.pushing import GRADS, KEYS, WAIT_S, encoded_gradient, push_to, raw_push, taken, until

pytestmark = pytest.mark.integration
PUSHERS = 24
PUSHES = 5
LARGE = 250_000


def test_many_pushers_and_a_slow_learner_each_push_counts_once_and_memory_is_bounded(endpoint: str) -> None:
    inbox = Inbox(most=6, most_bytes=8 * 4 * LARGE)
    stop = threading.Event()
    counted: Counter[tuple[str, int]] = Counter()
    most = [0]

    def learn() -> None:
        """Take pushes slowly; one that is repeated is acknowledged again and not counted, as the core does."""
        while not stop.is_set():
            most[0] = max(most[0], len(inbox))
            request = inbox.take(0.01)
            if request is None:
                continue
            stop.wait(0.005)
            identity = (request.message.actor, request.message.sequence)
            if identity not in counted:
                counted[identity] += 1
            request.answer(Accepted(1, len(counted)))

    replies: list[PushReply] = []

    def push(session: Session, actor: str) -> None:
        pusher = Pusher(session, stop)
        for sequence in range(PUSHES):
            gradient = samples.gradient_push(sequence, actor, LARGE)
            replies.append(pusher.push(KEYS.grads(actor), gradient, deadline_s=60.0))

    with samples.serving(endpoint, inbox=inbox) as (server, _), ExitStack() as stack:
        sessions = [stack.enter_context(open_client(endpoint)) for _ in range(4)]
        learner = threading.Thread(target=learn)
        learner.start()
        pushers = [threading.Thread(target=push, args=(sessions[n % 4], f"a{n}")) for n in range(PUSHERS)]
        for thread in pushers:
            thread.start()
        for thread in pushers:
            thread.join(60.0)
        stop.set()
        learner.join(WAIT_S)
        assert server.rejections.by_reason() == {}
    assert sum(isinstance(reply, Accepted) for reply in replies) == PUSHERS * PUSHES
    assert set(counted.values()) == {1}
    assert len(counted) == PUSHERS * PUSHES
    assert 2 <= most[0] <= 6, "some waited, and no more than may"


def test_a_stuck_learner_is_busy_for_what_waits_too_long(endpoint: str) -> None:
    # Nobody takes anything out of the inbox.
    with samples.serving(endpoint, inbox=Inbox(longest_wait_s=0.3)) as (server, _), open_client(endpoint) as session:
        began = time.monotonic()
        (answer,) = raw_push(session, GRADS, encoded_gradient(0))
        assert isinstance(decode(answer, Busy), Busy)
        assert 0.3 <= time.monotonic() - began < 2.0
        assert len(server.inbox) == 0
        assert server.inbox.take(0) is None


def test_a_push_that_waited_too_long_is_not_handed_to_the_learner(endpoint: str) -> None:
    with samples.serving(endpoint, inbox=Inbox(longest_wait_s=0.05)) as (server, _), open_client(endpoint) as session:
        answers: list[bytes] = []
        thread = threading.Thread(target=lambda: answers.extend(raw_push(session, GRADS, encoded_gradient(0))))
        thread.start()
        assert until(lambda: len(server.inbox) == 1)
        request = server.inbox._requests[0]
        assert until(lambda: time.monotonic() - request.arrived > 0.05)
        assert server.inbox.take(0) is None
        thread.join(WAIT_S)
        assert decode(answers[0], Busy).epoch == 1


def test_a_busy_learner_is_asked_again_later_and_later(learner: Server, client: Session) -> None:
    times: list[float] = []

    def answer_busy() -> None:
        for number in range(6):
            request = taken(learner.inbox)
            times.append(time.monotonic())
            request.answer(Busy(1) if number < 5 else Accepted(1, 1))

    thread = threading.Thread(target=answer_busy)
    thread.start()
    assert isinstance(push_to(client, samples.gradient_push()), Accepted)
    thread.join(WAIT_S)
    assert times[5] - times[4] > 2 * (times[1] - times[0]), "the pauses double"


def test_no_more_pushes_wait_than_may_be_behind_by_default(learner: Server, client: Session) -> None:
    threads = [
        threading.Thread(target=raw_push, args=(client, GRADS, encoded_gradient(n))) for n in range(MOST_WAITING)
    ]
    for thread in threads:
        thread.start()
    assert until(lambda: len(learner.inbox) == MOST_WAITING)
    (answer,) = raw_push(client, GRADS, encoded_gradient(MOST_WAITING))
    assert decode(answer, Busy).epoch == 1
    for _ in threads:
        taken(learner.inbox).answer(Accepted(1, 1))
    for thread in threads:
        thread.join(WAIT_S)
