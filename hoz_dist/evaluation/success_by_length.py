"""Success against the length of the optimal path."""

import math
import statistics
from collections.abc import Sequence
from typing import Final, NamedTuple

from hoz_dist.evaluation.episode_analysis import EpisodeAnalysis

LENGTHS: Final = (1, 5, 10, 15, 20, 30)
"""Least L* of each bin; the last one is open."""
NORMAL_95: Final = 1.959964
"""The normal distribution has 95% of its mass within so many standard deviations."""


class LengthBin(NamedTuple):
    """Success of the episodes whose L* lies in a range."""

    least: int
    most: int | None
    """Largest L*; None for the open bin."""
    episodes: int
    """Number of episodes of a trial."""
    sr: float
    """Percent."""
    low: float
    """Lower end of the 95% interval, percent."""
    high: float
    """Its upper end."""

    @property
    def label(self) -> str:
        """The range, for people."""
        return f"{self.least}+" if self.most is None else f"{self.least}-{self.most}"


def success_by_length(trials: Sequence[Sequence[EpisodeAnalysis]], lengths: Sequence[int] = LENGTHS) -> list[LengthBin]:
    """Bin episodes by L*; bins without episodes are left out.

    Trials repeat the same episodes and so tell little about others: an episode counts once, with its mean success. The
    intervals take episodes as independent and leave out how rooms and trainings differ; where these do, the intervals
    are too narrow.

    Args:
        trials: Trials of the same episodes in the same order.
        lengths: Least L* of each bin, ascending.
    """
    means = [(same[0].optimal, statistics.fmean(e.success for e in same)) for same in zip(*trials, strict=True)]
    bins = []
    for index, least in enumerate(lengths):
        most = lengths[index + 1] - 1 if index + 1 < len(lengths) else None
        inside = [success for optimal, success in means if least <= optimal and (most is None or optimal <= most)]
        if inside:
            low, high = wilson_interval(sum(inside), len(inside))
            bins.append(LengthBin(least, most, len(inside), 100 * statistics.fmean(inside), 100 * low, 100 * high))
    return bins


def wilson_interval(successes: float, count: int) -> tuple[float, float]:
    """Return the 95% interval of a share by Wilson's score, which holds for few episodes and shares near 0 or 1 too.

    Args:
        successes: How many succeeded; may be a sum of means.
        count: Of how many, at least 1.
    """
    share, square = successes / count, NORMAL_95**2 / count
    centre = (share + square / 2) / (1 + square)
    half = math.sqrt(share * (1 - share) * square + square**2 / 4) / (1 + square)
    return max(0.0, centre - half), min(1.0, centre + half)
