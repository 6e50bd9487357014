"""Which learner counts when there are two: for a moment, or because one was asleep.

A learner that stood still or was cut off may have been replaced, and may not know it yet. Its successor has a higher
epoch. So of several answers the one of the highest epoch counts, and a client that has heard of an epoch takes nothing
from a lower one.
"""

import threading
import time
from collections.abc import Iterable
from typing import Final, Protocol, TypeVar

from hoz_dist.errors import HozError

ANOTHER_RUN_S: Final = 20.0
"""A learner that was replaced notices it within a second. One that is served for so long, and none of the epoch that
was heard of before, is of a run that was begun anew."""


class Told(Protocol):
    """What a learner said."""

    @property
    def epoch(self) -> int:
        """Epoch of the learner."""
        ...


T = TypeVar("T", bound=Told)


class AnotherRunError(HozError):
    """The run that a client takes part in is over, and another one of its name has begun."""


def of_highest_epoch(told: Iterable[T]) -> T | None:
    """Return what the learner of the highest epoch said; None when nobody said anything."""
    return max(told, key=lambda one: one.epoch, default=None)


class Epochs:
    """The highest epoch that a client has heard of; it never falls. May be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._highest = 0
        self._lower_since: float | None = None
        """When a learner of a lower epoch first answered, since one that counts last did."""

    @property
    def highest(self) -> int:
        """The highest epoch that was heard of; 0 before any was."""
        return self._highest

    def hear(self, epoch: int) -> None:
        """Note an epoch that was heard of."""
        with self._lock:
            self._highest = max(self._highest, epoch)

    def choose(self, told: Iterable[T]) -> T | None:
        """Return what counts of that which learners said; None when nothing does.

        Raises:
            AnotherRunError: For a while now only learners of lower epochs have said anything.
        """
        newest = of_highest_epoch(told)
        if newest is None:
            return None
        with self._lock:
            if newest.epoch >= self._highest:
                self._highest = newest.epoch
                self._lower_since = None
                return newest
            now = time.monotonic()
            if self._lower_since is None:
                self._lower_since = now
            lasts = now - self._lower_since
        if lasts >= ANOTHER_RUN_S:
            message = (
                f"The learner has begun another run: it is in epoch {newest.epoch} and was in {self._highest}; "
                "start this process again."
            )
            raise AnotherRunError(message)
        return None
