"""What actors wrote down of the pushes that were acknowledged, and frames per second from it."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

WINDOW_S: Final = 1.0
SHARE: Final = 0.8
"""Share of the frames per second before a fault at which training counts as recovered."""
LASTING_S: Final = 3.0
"""A single good window is not enough: the mean over so long must be good as well."""
STEP_S: Final = 0.1
LEARNT_FROM: Final = frozenset({"gradient", "trajectory"})
"""Kinds of pushes that make a version of the parameters; a run has one of them."""


class Acknowledged(NamedTuple):
    """A push that the learner accepted."""

    actor: str
    time: float
    """When the actor got the answer, seconds since 1970."""
    kind: str
    incarnation: int
    sequence: int
    epoch: int
    """Epoch of the learner that accepted it."""
    version: int
    """Version of the parameters at the answer, so not less than the one that a gradient made."""
    frames: int = 0
    """Of a gradient or a rollout."""
    episodes: int = 0
    """Number of them."""


def read_journal(path: Path) -> list[Acknowledged]:
    """Read an actor's journal; a line that a killed actor did not finish is left out."""
    pushes = []
    for line in path.read_text(encoding="utf-8").splitlines(keepends=True):
        if line.endswith("\n"):
            values = json.loads(line)
            pushes.append(Acknowledged(**{name: values[name] for name in Acknowledged._fields if name in values}))
    return pushes


class FrameRate:
    """Frames per second, by the time at which gradients were acknowledged.

    Args:
        pushes: What was acknowledged, in any order.
    """

    def __init__(self, pushes: Iterable[Acknowledged]) -> None:
        gradients = sorted((push.time, push.frames) for push in pushes if push.kind in LEARNT_FROM)
        self._times: NDArray[np.float64] = np.array([time for time, _ in gradients])
        self._sums: NDArray[np.float64] = np.concatenate(([0.0], np.cumsum([frames for _, frames in gradients])))

    def between(self, begin: float, end: float) -> float:
        """Return the mean over a time."""
        first, last = np.searchsorted(self._times, (begin, end))
        return float(self._sums[last] - self._sums[first]) / (end - begin)

    def windows(self, begin: float, end: float) -> list[float]:
        """Return the frames per second of each whole second of a time."""
        return [self.between(begin + k, begin + k + WINDOW_S) for k in range(int((end - begin) / WINDOW_S))]

    def recovery(self, fault: float, before_s: float, longest_s: float) -> float | None:
        """Return how long after a fault the rate is back.

        It is back at the end of the first second, wholly after the fault, that has `SHARE` of the median second before
        the fault, if the `LASTING_S` from its beginning have so as well.

        Args:
            fault: When it began.
            before_s: How long before the fault the median is taken over.
            longest_s: How far to look.

        Returns:
            Seconds; None when it is not back within ``longest_s``.
        """
        wanted = SHARE * median(self.windows(fault - before_s, fault))
        for begin in fault + np.arange(0.0, longest_s, STEP_S):
            if self.between(begin, begin + WINDOW_S) >= wanted and self.between(begin, begin + LASTING_S) >= wanted:
                return float(begin + WINDOW_S - fault)
        return None


def first_of(pushes: Sequence[Acknowledged], actor: str, after: float) -> float | None:
    """Return how long after a time an actor's first gradient was acknowledged, seconds; None when none was."""
    times = [push.time for push in pushes if push.actor == actor and push.kind in LEARNT_FROM and push.time > after]
    return min(times) - after if times else None
