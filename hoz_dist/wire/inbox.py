"""Pushes that wait for the learner: one bounded queue."""

import threading
from collections import deque
from typing import Final

import zenoh

from hoz_dist.wire.messages import Push, PushReply, Refused
from hoz_dist.wire.queryable import answer
from hoz_dist.wire.rejection import Reason
from hoz_dist.wire.rejections import Rejections

MOST_WAITING: Final = 256
MOST_WAITING_BYTES: Final = 512 * 1024 * 1024


class Request:
    """A push that waits for its answer. It is answered once, by any thread; further answers do nothing.

    A request that is dropped without an answer makes the actor push again.

    Args:
        query: Zenoh's query.
        message: What was pushed, checked.
        size: Length of its encoded form, bytes.
        rejections: Where a refusal is counted.
    """

    def __init__(self, query: zenoh.Query, message: Push, size: int, rejections: Rejections) -> None:
        self.message = message
        self.size = size
        self._query: zenoh.Query | None = query
        self._key = str(query.key_expr)
        self._rejections = rejections
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


class Inbox:
    """A queue bounded by number and by bytes; full means that senders are told to wait.

    Args:
        most: Largest number of requests that wait.
        most_bytes: Largest number of bytes of all that wait; one request may always wait.
    """

    def __init__(self, most: int = MOST_WAITING, most_bytes: int = MOST_WAITING_BYTES) -> None:
        self._most = most
        self._most_bytes = most_bytes
        self._requests: deque[Request] = deque()
        self._bytes = 0
        self._filled = threading.Condition()

    def __len__(self) -> int:
        return len(self._requests)

    def offer(self, request: Request) -> bool:
        """Add a request at the end; False when there is no room."""
        with self._filled:
            full = len(self._requests) >= self._most or self._bytes + request.size > self._most_bytes
            if full and self._requests:
                return False
            self._requests.append(request)
            self._bytes += request.size
            self._filled.notify()
            return True

    def take(self, timeout_s: float) -> Request | None:
        """Remove and return the oldest request; None when none comes in time."""
        with self._filled:
            if not self._filled.wait_for(lambda: bool(self._requests), timeout_s):
                return None
            request = self._requests.popleft()
            self._bytes -= request.size
            return request
