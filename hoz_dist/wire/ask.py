"""Asking a question over Zenoh and gathering what comes back."""

import threading
from typing import Final, NamedTuple

import zenoh
from zenoh import Session
from zenoh.handlers import FifoChannel

from hoz_dist.wire.waiting import Deadline, StoppedError

_TIMED_OUT: Final = b"Timeout"
"""What Zenoh itself puts into an error reply when a queryable holds a query too long."""
_FIRST_PAUSE_S: Final = 0.0002
_LONGEST_PAUSE_S: Final = 0.005
_MARGIN_S: Final = 1.0
"""Zenoh ends a query by itself; this much later we stop believing that it will."""


class Answer(NamedTuple):
    """One reply."""

    key: str
    """Concrete key that it came from; empty for an error reply."""
    payload: bytes


def ask(
    session: Session,
    selector: str,
    *,
    timeout_s: float,
    stop: threading.Event | None = None,
    payload: bytes | None = None,
    attachment: bytes | None = None,
) -> list[Answer]:
    """Send a query and return all replies that come in time, error replies included.

    An empty list means that nobody answers: no queryable, a learner that died or left, or a denied access. Zenoh does
    not tell these apart.

    Args:
        session: Session to ask on.
        selector: Key expression and parameters.
        timeout_s: How long to wait for the last reply.
        stop: Ends the wait early.
        payload: What to send along.
        attachment: What to send along besides.

    Raises:
        StoppedError: The stop event was set.
    """
    stop = stop or threading.Event()
    replies: zenoh.handlers.Handler[zenoh.Reply] = session.get(
        selector,
        FifoChannel(1024),
        timeout=timeout_s,
        consolidation=zenoh.ConsolidationMode.NONE,
        payload=payload,
        attachment=attachment,
    )
    answers: list[Answer] = []
    deadline = Deadline(timeout_s + _MARGIN_S)
    pause = _FIRST_PAUSE_S
    # Polling, because a blocking receive cannot be stopped.
    while not deadline.passed:
        try:
            reply = replies.try_recv()
        except zenoh.ZError:  # the channel is closed: that was the last reply
            break
        if reply is None:
            if stop.wait(pause):
                raise StoppedError
            pause = min(1.5 * pause, _LONGEST_PAUSE_S)
        elif reply.ok is not None:
            answers.append(Answer(str(reply.ok.key_expr), reply.ok.payload.to_bytes()))
        elif reply.err is not None and (error := reply.err.payload.to_bytes()) != _TIMED_OUT:
            answers.append(Answer("", error))
    return answers
