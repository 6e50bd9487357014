"""Counting and logging rejections."""

import logging
import threading
import time
from collections import Counter
from typing import Final

from hoz_dist.wire.protocol.rejection import Reason, plain

_log = logging.getLogger(__name__)
LOG_EVERY_S: Final = 10.0
"""A sender's rejections for one reason are logged at most this often, so that a flood does not fill the disk."""
MOST_LINES: Final = 100
"""So many lines are logged within that time, whoever sends what."""
MOST_SENDERS: Final = 1024
"""Number of senders that are told apart, so that invented names do not fill the memory; the rest count as one."""
OTHER_SENDERS: Final = "(others)"


class Rejections:
    """Counts by reason and by sender; may be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._reasons: Counter[str] = Counter()
        self._senders: Counter[str] = Counter()
        self._logged: set[tuple[str, Reason]] = set()
        """Whose rejections were logged since `_began`."""
        self._began = -LOG_EVERY_S

    def count(self, reason: Reason, detail: str, sender: str) -> None:
        """Count one rejection, and log it unless the like was logged a moment ago."""
        now = time.monotonic()
        with self._lock:
            if sender not in self._senders and len(self._senders) >= MOST_SENDERS:
                sender = OTHER_SENDERS
            self._reasons[reason.value] += 1
            self._senders[sender] += 1
            total = self._senders[sender]
            if now - self._began >= LOG_EVERY_S:
                self._began = now
                self._logged.clear()
            if (sender, reason) in self._logged or len(self._logged) >= MOST_LINES:
                return
            self._logged.add((sender, reason))
        _log.warning(
            "rejected a message of %s (%s): %s; %d of this sender so far", sender, reason, plain(detail), total
        )

    def by_reason(self) -> dict[str, int]:
        """Return the number of rejections for each reason that occurred."""
        with self._lock:
            return dict(self._reasons)

    def by_sender(self) -> dict[str, int]:
        """Return the number of rejections of each sender that had one."""
        with self._lock:
            return dict(self._senders)
