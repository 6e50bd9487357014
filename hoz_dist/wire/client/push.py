"""Acknowledged push: what an actor sends is sent again until the learner says what became of it.

Plain publications are lost silently under load, so a push is a Zenoh query with a payload. No answer in time, an empty
answer, or ``busy`` mean: wait and send it again. The learner knows a repetition by (actor, incarnation, sequence).
"""

import threading
from collections.abc import Callable

from hoz_dist.errors import ConnectionFailedError
from hoz_dist.stages import StageClock
from hoz_dist.waiting import FIRST_TRY_S, Backoff, Deadline
from hoz_dist.wire.client.asking import Asking
from hoz_dist.wire.client.epochs import Epochs
from hoz_dist.wire.protocol.answers import Accepted, Busy, Refused
from hoz_dist.wire.protocol.codec import lay_out
from hoz_dist.wire.protocol.pushes import GradientPush, Push
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.trajectories import TrajectoryPush
from hoz_dist.wire.transport.outgoing import Outgoing
from hoz_dist.wire.transport.session import Session
from hoz_dist.wire.transport.shared_memory import SharedMemory


class Pusher:
    """Pushes messages to the learner, one at a time: a thread that pushes waits until its push is acknowledged.

    Args:
        session: Client session of the actor.
        stop: Ends a push that waits.
        attempt_s: How long the first try waits for an answer, seconds; see `Patience`.
        epochs: What is known of the learner's epochs; what a learner of a lower one answers counts as no answer.
        acknowledged: Told of each push that was accepted: the push, the answer, and how often it was sent.
        memory: Shared memory for large messages; None for none.
        clock: Measures how long answers take, as the stage ``answer``.
    """

    def __init__(
        self,
        session: Session,
        stop: threading.Event,
        attempt_s: float = FIRST_TRY_S,
        epochs: Epochs | None = None,
        acknowledged: Callable[[Push, Accepted, int], None] | None = None,
        memory: SharedMemory | None = None,
        clock: StageClock | None = None,
    ) -> None:
        self._stop = stop
        self._epochs = epochs or Epochs()
        self._asking = Asking(session, stop, self._epochs, attempt_s)
        self._acknowledged = acknowledged
        self._outgoing = Outgoing(memory or SharedMemory(on=False))
        self._clock = clock or StageClock()

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
            OtherVersionError: The learner speaks another version of the protocol.
            AnotherRunError: The learner has begun another run.
        """
        layout = lay_out(message)
        deadline, backoff = Deadline(deadline_s), Backoff(self._stop)
        tries = 0
        if isinstance(message, GradientPush | TrajectoryPush):
            self._epochs.hear(message.epoch)
        while True:
            tries += 1
            data, attachment = self._outgoing.payload(layout)  # anew: a paused receiver's may have been written over
            with self._clock("answer"):
                reply = self._asking.once(key, deadline, Accepted, Busy, Refused, payload=data, attachment=attachment)
            match reply:
                case Accepted():
                    if self._acknowledged is not None:
                        self._acknowledged(message, reply, tries)
                    return reply
                case Refused(reason=reason) if reason != Reason.CHECKSUM:  # damaged on the way: the same again helps
                    return reply
            if deadline.passed:
                message_text = f"The learner did not acknowledge a {message.KIND} within {deadline_s:g} s."
                raise ConnectionFailedError(message_text)
            backoff.pause(deadline)
