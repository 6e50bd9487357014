"""Pushes that wait for the learner: one queue, bounded by number, bytes and age.

A gradient that waits grows stale, so few wait and none for long; the others are told ``busy`` and come again.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final

import zenoh

from hoz_dist.closing import Closing
from hoz_dist.wire.protocol.answers import Busy, PushReply, Refused
from hoz_dist.wire.protocol.pushes import Push
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.rejections import Rejections
from hoz_dist.wire.transport.queryable import answer

MOST_WAITING: Final = 32
"""The default of `RunConfig.max_lag`: a gradient that waits behind more than that is stale when its turn comes."""
MOST_WAITING_BYTES: Final = 256 * 1024 * 1024
"""Of the messages. They are in memory twice: Zenoh's query keeps what it received until it is answered."""
LONGEST_WAIT_S: Final = 5.0
"""Half of what the sender waits for its answer at first: it hears ``busy`` before it gives the learner up."""
_LOOK_EVERY_S: Final = 0.25


class Request:
    """A push that waits for its answer. It is answered once, by any thread; further answers do nothing.

    A request that is dropped without an answer makes the actor push again.

    Args:
        query: Zenoh's query.
        message: What was pushed, checked.
        size: Length of its encoded form, bytes.
        rejections: Where a refusal is counted.
        epoch: Epoch of the learner.

    Attributes:
        arrived: When it came, seconds of the monotonic clock.
    """

    def __init__(self, query: zenoh.Query, message: Push, size: int, rejections: Rejections, epoch: int) -> None:
        self.message = message
        self.size = size
        self.arrived = time.monotonic()
        self._query: zenoh.Query | None = query
        self._key = str(query.key_expr)
        self._rejections = rejections
        self._epoch = epoch
        self._lock = threading.Lock()

    def answer(self, reply: PushReply) -> None:
        """Say what became of the push; a refusal is counted as a rejection, and logged."""
        with self._lock:
            query, self._query = self._query, None
        if query is None:
            return
        if isinstance(reply, Refused) and reply.reason != Reason.FINISHED:
            self._rejections.count(Reason(reply.reason), reply.detail, self.message.actor)
        answer(query, self._key, reply)

    def put_off(self) -> None:
        """Ask the sender to come again."""
        self.answer(Busy(self._epoch))


class Inbox:
    """A bounded queue of requests; those that wait too long are put off.

    Args:
        most: Largest number of requests that wait.
        most_bytes: Largest number of bytes of all messages that wait, half of the memory that they take; one may always
            wait.
        longest_wait_s: How long a request waits, seconds.

    Attributes:
        put_off: Number of requests that were put off, for want of room or because they waited too long.
    """

    def __init__(
        self,
        most: int = MOST_WAITING,
        most_bytes: int = MOST_WAITING_BYTES,
        longest_wait_s: float = LONGEST_WAIT_S,
    ) -> None:
        self._most = most
        self._most_bytes = most_bytes
        self._longest_wait_s = longest_wait_s
        self._requests: deque[Request] = deque()
        self._bytes = 0
        self._filled = threading.Condition()
        self.put_off = 0

    def __len__(self) -> int:
        return len(self._requests)

    def add(self, request: Request) -> None:
        """Add a request at the end, or put it off when there is no room."""
        with self._filled:
            full = len(self._requests) >= self._most or self._bytes + request.size > self._most_bytes
            full = full and bool(self._requests)
            if full:
                self.put_off += 1
            else:
                self._requests.append(request)
                self._bytes += request.size
                self._filled.notify()
        if full:
            request.put_off()

    def take(self, timeout_s: float) -> Request | None:
        """Remove and return the oldest request; None when none comes in time."""
        self.put_off_late()
        with self._filled:
            if not self._filled.wait_for(lambda: bool(self._requests), timeout_s):
                return None
            return self._pop()

    def put_off_late(self) -> None:
        """Put those off that have waited too long."""
        too_old = time.monotonic() - self._longest_wait_s
        late = []
        with self._filled:
            while self._requests and self._requests[0].arrived < too_old:
                late.append(self._pop())
            self.put_off += len(late)
        for request in late:
            request.put_off()

    def _pop(self) -> Request:
        request = self._requests.popleft()
        self._bytes -= request.size
        return request


class Reaper(Closing):
    """A thread that puts late requests off, also while the learner's own thread is stuck.

    Args:
        put_off_late: Does so; called a few times a second.
    """

    def __init__(self, put_off_late: Callable[[], None]) -> None:
        self._put_off_late = put_off_late
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="hoz puts late pushes off", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the thread."""
        self._closed.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._closed.wait(_LOOK_EVERY_S):
            self._put_off_late()
