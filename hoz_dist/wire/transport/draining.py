"""Threads that drain Zenoh's channels at once.

A channel that is left to fill blocks Zenoh's receive thread, and after a while the sender's transport is closed. Python
callbacks are no way out: each has a thread that is not a daemon, and keeps the interpreter from ending.
"""

import logging
import math
import threading
import time
from collections.abc import Callable, Iterable
from typing import Final, Generic, Protocol, TypeVar

_log = logging.getLogger(__name__)
LOG_EVERY_S: Final = 10.0
"""A thread logs a traceback at most this often: whoever knows how to cause one must not fill the disk."""
T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class Declared(Protocol[T_co]):
    """A subscriber or queryable of Zenoh with a channel."""

    @property
    def handler(self) -> Iterable[T_co]:
        """The channel."""
        ...

    def undeclare(self) -> object:
        """End the channel."""
        ...


class Drain(Generic[T]):
    """A thread that handles what comes out of a channel, one by one.

    Args:
        declared: What the channel belongs to; `close` undeclares it.
        handle: Handles one sample or query. Should it raise, that is logged now and then and the thread goes on.
        name: Name of the thread.
    """

    def __init__(self, declared: Declared[T], handle: Callable[[T], None], name: str) -> None:
        self._declared = declared
        self._handle = handle
        self._logged_at = -math.inf
        self._unlogged = 0
        self._thread = threading.Thread(target=self._run, name=f"hoz {name}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Undeclare, and wait for the thread to end."""
        self._declared.undeclare()
        self._thread.join()

    def _run(self) -> None:
        # Receiving from the declared object instead of its channel would lock it against `undeclare`.
        for received in self._declared.handler:
            try:
                self._handle(received)
            except Exception:  # noqa: BLE001 - a sender must not be able to end the thread
                self._log_failure()

    def _log_failure(self) -> None:
        """Log the exception that is being handled, unless one was logged a moment ago."""
        now = time.monotonic()
        if now - self._logged_at < LOG_EVERY_S:
            self._unlogged += 1
            return
        name = self._thread.name
        _log.exception("%s: failed to handle a message; %d more since the last time", name, self._unlogged)
        self._logged_at, self._unlogged = now, 0
