"""What the tests of the wire do again and again: push, take, answer, wait."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.protocol.answers import PushReply
from hoz_dist.wire.protocol.codec import checksum, encode
from hoz_dist.wire.protocol.pushes import Push
from hoz_dist.wire.serving.inbox import Inbox, Request
from hoz_dist.wire.transport.ask import ask
from hoz_dist.wire.transport.session import Session
from tests import wire_samples as samples
from tests.waiting import comes_true

KEYS = samples.KEYS
GRADS = KEYS.grads("a0")
WAIT_S = 10.0


@contextmanager
def answering(inbox: Inbox, decide: Callable[[Push], PushReply]) -> Iterator[list[Push]]:
    """Take pushes out of an inbox and answer them in a thread, as a learner does; gives what came."""
    stop = threading.Event()
    came: list[Push] = []

    def work() -> None:
        while not stop.is_set():
            request = inbox.take(0.01)
            if request is not None:
                came.append(request.message)
                request.answer(decide(request.message))

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield came
    finally:
        stop.set()
        thread.join()


def until(condition: Callable[[], bool]) -> bool:
    """Wait until something is true; False when it does not come true in time."""
    return comes_true(condition, WAIT_S)


def push_to(session: Session, push: Push, key: str = GRADS) -> PushReply:
    return Pusher(session, threading.Event()).push(key, push, deadline_s=WAIT_S)


def taken(inbox: Inbox) -> Request:
    request = inbox.take(WAIT_S)
    assert request is not None
    return request


def encoded_gradient(sequence: int, size: int = 100) -> bytes:
    return encode(samples.gradient_push(sequence, size=size))


def raw_push(session: Session, key: str, payload: bytes, attachment: bytes | None = None) -> list[bytes]:
    sum_of = checksum(payload) if attachment is None else attachment
    return [answer.payload for answer in ask(session, key, timeout_s=5.0, payload=payload, attachment=sum_of)]
