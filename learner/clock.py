"""The time that a run has trained."""

from typing import Final

LONGEST_GAP_S: Final = 60.0
"""What a gap between two pushes lasts beyond this does not count: the actors were away, and nothing was trained."""


class TrainingClock:
    """Counts the time from push to push.

    Args:
        seconds: Training time of earlier epochs.
    """

    def __init__(self, seconds: float = 0.0) -> None:
        self._before = seconds
        """Time until the last push."""
        self._last: float | None = None
        """When the last push came; None when time does not count."""

    def seconds(self, now: float) -> float:
        """Return the training time so far; never falls."""
        return self._before + (min(now - self._last, LONGEST_GAP_S) if self._last is not None else 0.0)

    def push(self, now: float) -> None:
        """Note a push that counts."""
        self._before, self._last = self.seconds(now), now

    def stop(self, now: float) -> None:
        """Count no more from now on, until the next push."""
        self._before, self._last = self.seconds(now), None
