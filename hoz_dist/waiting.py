"""Waiting that can be stopped, and retries that spread out."""

import random
import threading
import time
from typing import Final

FIRST_PAUSE_S: Final = 0.05
LONGEST_PAUSE_S: Final = 2.0
FIRST_TRY_S: Final = 10.0
"""How long the first try waits for an answer; longer than a slow learner takes for the pushes before it."""
LONGER_TRIES: Final = 16
"""How many times as long the longest try waits: over a link that loses packets a gradient may take half a minute."""


_RANDOM: Final = random.Random()
"""Of our own: a program that seeds Python's would make all its actors wait alike."""


class StoppedError(Exception):
    """The process was told to stop while it waited; not a failure."""


class Deadline:
    """A moment until which something may take.

    Args:
        seconds: From now; None for no end.
    """

    def __init__(self, seconds: float | None) -> None:
        self._end = None if seconds is None else time.monotonic() + seconds

    @property
    def passed(self) -> bool:
        """Whether it is over."""
        return self._end is not None and time.monotonic() >= self._end

    def within(self, seconds: float) -> float:
        """Return the time that is left, but not more than ``seconds``; never negative."""
        return seconds if self._end is None else max(0.0, min(seconds, self._end - time.monotonic()))


class Backoff:
    """Pauses between retries: twice as long each time, each of a random length up to that.

    Without the randomness, actors that lost the learner together would all come back at the same moment, every time.
    """

    def __init__(self, stop: threading.Event) -> None:
        self._stop = stop
        self._longest = FIRST_PAUSE_S

    def pause(self, deadline: Deadline) -> None:
        """Wait until the next try.

        Raises:
            StoppedError: The stop event was set.
        """
        length = _RANDOM.uniform(self._longest / 2, self._longest)
        self._longest = min(2 * self._longest, LONGEST_PAUSE_S)
        if self._stop.wait(deadline.within(length)):
            raise StoppedError


class Patience:
    """How long a try waits for its answer: twice as long after each that got none in time.

    What a slow link has not yet carried when a try ends is carried all the same, in front of the next try. Tries that
    are all too short would never get through.

    Args:
        first_s: Of the first try, seconds.

    Attributes:
        seconds: Of the next try.
    """

    def __init__(self, first_s: float = FIRST_TRY_S) -> None:
        self._first_s = first_s
        self.seconds = first_s

    def timed_out(self) -> None:
        """Note that no answer came in time."""
        self.seconds = min(2 * self.seconds, LONGER_TRIES * self._first_s)

    def answered(self, after_s: float) -> None:
        """Note that an answer came, whatever it was, so many seconds after it was asked for."""
        self.seconds = min(max(2 * after_s, self._first_s), LONGER_TRIES * self._first_s)
