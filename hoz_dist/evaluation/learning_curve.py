"""Learning curves: success on validation rooms against frames, and the frames that a success rate takes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class LearningCurve(NamedTuple):
    """Success along one run, measured at its kept checkpoints."""

    frames: tuple[int, ...]
    """Ascending."""
    success: tuple[float, ...]
    """SR on the validation rooms at each of them, percent."""


class MeanCurve(NamedTuple):
    """Several runs of a method at common numbers of frames."""

    frames: NDArray[np.float64]
    mean: NDArray[np.float64]
    """Mean SR over runs, percent."""
    low: NDArray[np.float64]
    """SR of the worst run."""
    high: NDArray[np.float64]
    """SR of the best run."""


def frames_to(curve: LearningCurve, success: float) -> float | None:
    """Return the frames after which a run first had a success rate; None when it never had.

    Between two checkpoints success is taken to grow in a straight line, and before the first one from 0 at the start.
    A rate that is had once and lost again counts, so a curve that swings is flattered.

    Args:
        curve: The run.
        success: SR, percent, more than 0.
    """
    frames, rates = (0, *curve.frames), (0.0, *curve.success)
    for index in range(1, len(rates)):
        if rates[index] >= success:
            # The one before is below it, or the loop would have ended there.
            share = (success - rates[index - 1]) / (rates[index] - rates[index - 1])
            return frames[index - 1] + share * (frames[index] - frames[index - 1])
    return None


def mean_curve(curves: Sequence[LearningCurve]) -> MeanCurve | None:
    """Put runs together at the checkpoints of the first, as far as all of them go.

    Args:
        curves: At least one, each with at least one checkpoint.

    Returns:
        The mean; None when one run ends before another begins.
    """
    begin, end = max(curve.frames[0] for curve in curves), min(curve.frames[-1] for curve in curves)
    if begin > end:
        return None
    # Runs stop a few frames apart; without its ends the range could be empty.
    grid = np.unique([begin, end, *(frames for frames in curves[0].frames if begin <= frames <= end)])
    rates = np.stack([np.interp(grid, curve.frames, curve.success) for curve in curves])
    return MeanCurve(grid.astype(np.float64), rates.mean(axis=0), rates.min(axis=0), rates.max(axis=0))
