"""Asking the learner until it answers: what pushes and fetches have in common."""

import logging
import threading
import time
from typing import TypeVar

from zenoh import Session, ZBytes

from hoz_dist.outage import Outage
from hoz_dist.waiting import FIRST_TRY_S, Deadline, Patience
from hoz_dist.wire.client.epochs import Epochs
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.rejection import OtherVersionError, RejectedError
from hoz_dist.wire.transport.ask import Question, messages_in

_log = logging.getLogger(__name__)
M = TypeVar("M", bound=Message)


class Asking:
    """Sends queries to the learner, and tells what counts of the answers; says once when it is away.

    Args:
        session: Client session.
        stop: Ends a wait.
        epochs: What is known of the learner's epochs; what a learner of a lower one answers counts as no answer.
        first_try_s: How long the first try waits for an answer, seconds; see `Patience`.
    """

    def __init__(
        self, session: Session, stop: threading.Event, epochs: Epochs, first_try_s: float = FIRST_TRY_S
    ) -> None:
        self._session = session
        self._stop = stop
        self._epochs = epochs
        self._patience = Patience(first_try_s)
        self._outage = Outage(_log, "the learner does not answer; trying again", "the learner answers again")

    def once(
        self,
        selector: str,
        deadline: Deadline,
        *expected: type[M],
        payload: bytes | ZBytes | None = None,
        attachment: bytes | None = None,
    ) -> M | None:
        """Ask once; None when no answer that counts came in time.

        Args:
            selector: Key expression and parameters.
            deadline: Ends the wait early.
            expected: Kinds of the answer, each with an epoch.
            payload: What to send along.
            attachment: What to send along besides.

        Raises:
            StoppedError: The stop event was set.
            OtherVersionError: The learner speaks another version of the protocol.
            AnotherRunError: The learner has begun another run.
        """
        return self.finish(self.begin(selector, deadline, payload, attachment), *expected)

    def begin(
        self,
        selector: str,
        deadline: Deadline,
        payload: bytes | ZBytes | None = None,
        attachment: bytes | None = None,
    ) -> Question:
        """Ask, without waiting for the answer; see `once`."""
        timeout_s = deadline.within(self._patience.seconds)
        return Question(self._session, selector, timeout_s, payload, attachment)

    def finish(self, question: Question, *expected: type[M]) -> M | None:
        """Wait for the answer to a question; see `once`."""
        answers = question.gather(self._stop)
        if answers:
            self._patience.answered(time.monotonic() - question.asked)
        elif answers.timed_out:
            self._patience.timed_out()
        try:
            reply = self._epochs.choose(messages_in(answers, *expected))  # type: ignore[type-var]  # see `expected`
        except OtherVersionError:
            raise
        except RejectedError as error:
            _log.warning("the learner's answer cannot be read: %s", error)
            reply = None
        if reply is None:
            self._outage.failed()
        else:
            self._outage.worked()
        return reply
