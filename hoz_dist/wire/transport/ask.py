"""Asking a question over Zenoh and gathering what comes back."""

import threading
from collections.abc import Iterable
from typing import Final, NamedTuple, TypeVar

import zenoh
from zenoh import Session
from zenoh.handlers import FifoChannel

from hoz_dist.waiting import Deadline, StoppedError
from hoz_dist.wire.protocol.codec import decode
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.rejection import RejectedError

_TIMED_OUT: Final = b"Timeout"
"""What Zenoh itself puts into an error reply when a queryable holds a query too long."""
_FIRST_PAUSE_S: Final = 0.0001
_LONGEST_PAUSE_S: Final = 0.005
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
        self.answers = Answers()
        self._deadline = Deadline(timeout_s + _MARGIN_S)
        self._replies: zenoh.handlers.Handler[zenoh.Reply] = session.get(
            selector,
            FifoChannel(1024),
            timeout=timeout_s,
            consolidation=zenoh.ConsolidationMode.NONE,
            payload=payload,
            attachment=attachment,
        )

    def poll(self) -> bool:
        """Gather what has come; True when nothing more will."""
        while True:
            try:
                reply = self._replies.try_recv()
            except zenoh.ZError:  # the channel is closed: that was the last reply
                return True
            if reply is None:
                break
            if reply.ok is not None:
                self._add(str(reply.ok.key_expr), reply.ok.payload)
            elif reply.err is not None:
                self._add("", reply.err.payload)
        if self._deadline.passed:
            self.answers.timed_out = not self.answers
            return True
        return False

    def _add(self, key: str, payload: zenoh.ZBytes) -> None:
        answer = Answer(key, payload.to_bytes())
        if not key and answer.payload == _TIMED_OUT:
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
    stop = stop or threading.Event()
    question = Question(session, selector, timeout_s, payload, attachment)
    pause = _FIRST_PAUSE_S
    # Polling, because a blocking receive cannot be stopped.
    while not question.poll():
        if stop.wait(pause):
            raise StoppedError
        pause = min(1.2 * pause, _LONGEST_PAUSE_S)
    return question.answers


def messages_in(answers: Iterable[Answer], *expected: type[M]) -> list[M]:
    """Return the messages that answers hold.

    Those that cannot be read are left out, unless there are no others: a learner of another release may serve another
    run on the same router.

    Raises:
        RejectedError: There are answers, and none can be read.
    """
    messages: list[M] = []
    rejected: RejectedError | None = None
    for answer in answers:
        try:
            messages.append(decode(answer.payload, *expected))
        except RejectedError as error:
            rejected = rejected or error
    if rejected is not None and not messages:
        raise rejected
    return messages
