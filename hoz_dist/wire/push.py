"""Acknowledged push: what an actor sends is sent again until the learner says what became of it.

Plain publications are lost silently under load, so a push is a Zenoh query with a payload. No answer in time, an empty
answer, or ``busy`` mean: wait and send it again. The learner knows a repetition by (actor, incarnation, sequence).
"""

import logging
import threading
from typing import Final

from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.ask import ask
from hoz_dist.wire.codec import checksum, decode, encode
from hoz_dist.wire.messages import Accepted, Busy, Push, PushReply, Refused
from hoz_dist.wire.outage import learner_outage
from hoz_dist.wire.rejection import Reason, RejectedError
from hoz_dist.wire.session import Session
from hoz_dist.wire.waiting import Backoff, Deadline

_log = logging.getLogger(__name__)
ATTEMPT_S: Final = 10.0
"""How long one try waits for the learner's answer; longer than a slow learner takes for the pushes before it."""


class Pusher:
    """Pushes messages to the learner.

    Args:
        session: Client session of the actor.
        stop: Ends a push that waits.
        attempt_s: How long one try waits for an answer, seconds.
    """

    def __init__(self, session: Session, stop: threading.Event, attempt_s: float = ATTEMPT_S) -> None:
        self._session = session
        self._stop = stop
        self._attempt_s = attempt_s
        self._outage = learner_outage(_log)

    def push(self, key: str, message: Push, deadline_s: float | None = None) -> Accepted | Refused:
        """Send a message until it is acknowledged.

        Args:
            key: Where to.
            message: What.
            deadline_s: When to give up, seconds from now; None for never.

        Returns:
            What became of it. A refused message must not be sent again.

        Raises:
            StoppedError: The stop event was set.
            ConnectionFailedError: The deadline passed; the learner may have taken the message all the same.
        """
        payload = encode(message)
        attachment = checksum(payload)
        deadline, backoff = Deadline(deadline_s), Backoff(self._stop)
        while True:
            reply = self._try(key, payload, attachment, deadline.within(self._attempt_s))
            if isinstance(reply, Accepted | Refused):
                return reply
            if deadline.passed:
                message_text = f"The learner did not acknowledge a {message.KIND} within {deadline_s:g} s."
                raise ConnectionFailedError(message_text)
            backoff.pause(deadline)

    def _try(self, key: str, payload: bytes, attachment: bytes, timeout_s: float) -> PushReply | None:
        """Send once; None when there is no answer."""
        answers = ask(self._session, key, timeout_s=timeout_s, stop=self._stop, payload=payload, attachment=attachment)
        if not answers:
            self._outage.failed()
            return None
        self._outage.worked()
        try:
            reply = decode(answers[0].payload, Accepted, Busy, Refused)
        except RejectedError as error:
            # A learner of another version, say: sending the same again would not help.
            return Refused(error.reason, error.detail)
        if isinstance(reply, Refused) and reply.reason == Reason.CHECKSUM:
            return None  # damaged on the way: this time the same again does help
        return reply  # type: ignore[return-value]  # one of the three that were expected
