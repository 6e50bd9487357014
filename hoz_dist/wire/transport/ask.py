"""Asking a question over Zenoh and gathering what comes back."""

import queue
import threading
import time
from collections.abc import Iterable
from typing import Final, NamedTuple, TypeVar

import zenoh
from zenoh import Session
from zenoh.handlers import Callback

from hoz_dist.waiting import Deadline, StoppedError
from hoz_dist.wire.protocol.codec import checksum, decode
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.rejection import Reason, RejectedError

_TIMED_OUT: Final = b"Timeout"
"""What Zenoh itself puts into an error reply when a queryable holds a query too long."""
_LOOK_S: Final = 0.05
"""How soon a wait notices that it is to stop; an answer it notices at once."""
_MARGIN_S: Final = 1.0
"""Zenoh ends a query by itself; this much later we stop believing that it will."""
STRAGGLERS_S: Final = 1.0
"""How long to wait for further answers after one has come: a second learner may stand still."""

M = TypeVar("M", bound=Message)


class Answer(NamedTuple):
    """One reply."""

    key: str
    """Concrete key that it came from; empty for an error reply."""
    payload: bytes
    checksum: bytes | None = None
    """What was sent along as the payload's checksum."""


class Answers(list[Answer]):
    """The replies to a question, in the order in which they came.

    None at all means that nobody answers: no queryable, a learner that died or left, or a denied access, which Zenoh
    does not tell apart; or, when `timed_out`, that somebody did not answer in time.

    Attributes:
        timed_out: Somebody who was asked did not answer in time.
    """

    timed_out: bool = False


class Question:
    """A query that is under way.

    Args:
        session: Session to ask on.
        selector: Key expression and parameters.
        timeout_s: How long to wait for the last reply.
        payload: What to send along.
        attachment: What to send along besides.

    Attributes:
        asked: When it was asked, seconds of the monotonic clock.
        answers: What came back so far.
    """

    def __init__(
        self,
        session: Session,
        selector: str,
        timeout_s: float,
        payload: bytes | zenoh.ZBytes | None = None,
        attachment: bytes | None = None,
    ) -> None:
        self.asked = time.monotonic()
        self.answers = Answers()
        self._deadline = Deadline(timeout_s + _MARGIN_S)
        # Zenoh's own channels can be polled, or waited for without end. So its receive thread fills a queue of ours,
        # which is all that it does, and is waited for with an end.
        replies: queue.SimpleQueue[zenoh.Reply | None] = queue.SimpleQueue()
        self._replies = replies
        session.get(
            selector,
            Callback(replies.put, lambda: replies.put(None), indirect=False),
            timeout=timeout_s,
            consolidation=zenoh.ConsolidationMode.NONE,
            payload=payload,
            attachment=attachment,
        )

    def gather(self, stop: threading.Event) -> Answers:
        """Wait until nothing more will come, or the time is over, and return what came.

        Raises:
            StoppedError: The stop event was set.
        """
        while not self._deadline.passed:
            try:
                reply = self._replies.get(timeout=self._deadline.within(_LOOK_S))
            except queue.Empty:
                if stop.is_set():
                    raise StoppedError from None
                continue
            if reply is None:
                return self.answers
            if reply.ok is not None:
                attachment = reply.ok.attachment
                told = None if attachment is None else attachment.to_bytes()
                self._add(Answer(str(reply.ok.key_expr), reply.ok.payload.to_bytes(), told))
            elif reply.err is not None:
                self._add(Answer("", reply.err.payload.to_bytes()))
        self.answers.timed_out = not self.answers
        return self.answers

    def _add(self, answer: Answer) -> None:
        if not answer.key and answer.payload == _TIMED_OUT:
            self.answers.timed_out = True
            return
        self.answers.append(answer)
        self._deadline = Deadline(self._deadline.within(STRAGGLERS_S))


def ask(
    session: Session,
    selector: str,
    *,
    timeout_s: float,
    stop: threading.Event | None = None,
    payload: bytes | zenoh.ZBytes | None = None,
    attachment: bytes | None = None,
) -> Answers:
    """Send a query and return all replies that come in time, error replies included.

    Args:
        session: Session to ask on.
        selector: Key expression and parameters.
        timeout_s: How long to wait for the first reply; others may come `STRAGGLERS_S` after the one before.
        stop: Ends the wait early.
        payload: What to send along.
        attachment: What to send along besides.

    Raises:
        StoppedError: The stop event was set.
    """
    question = Question(session, selector, timeout_s, payload, attachment)
    return question.gather(stop or threading.Event())


def messages_in(answers: Iterable[Answer], *expected: type[M]) -> list[M]:
    """Return the messages that answers hold.

    Those that cannot be read, or do not have the checksum sent along, are left out, unless there are no others: a
    learner of another release may serve another run on the same router.

    Raises:
        RejectedError: There are answers, and none can be read.
    """
    messages: list[M] = []
    rejected: RejectedError | None = None
    for answer in answers:
        try:
            messages.append(_checked(answer, *expected))
        except RejectedError as error:
            rejected = rejected or error
    if rejected is not None and not messages:
        raise rejected
    return messages


def _checked(answer: Answer, *expected: type[M]) -> M:
    """Return the message that an answer holds.

    Raises:
        RejectedError: It was damaged on the way, or cannot be read.
    """
    if answer.checksum is not None and answer.checksum != checksum(answer.payload):
        raise RejectedError(
            Reason.CHECKSUM, f"the {len(answer.payload)} bytes of the answer do not have the checksum sent along"
        )
    return decode(answer.payload, *expected)
