"""Confidence intervals of differences between rows: a bootstrap over seeds and episodes at once.

A figure is uncertain because other seeds would have trained other agents, and because other episodes would have been
drawn. Both are resampled: in each replicate the seeds of a row, with replacement, and the episodes, with replacement.
All rows were tested on the same episodes, so each replicate draws the *same* episodes for both rows: what makes an
episode hard cancels out. When both rows have the same seeds, it draws the same seeds too, as they share the draw of
initial parameters; else each row's own. Trials are not resampled: their mean enters.

Seeds are few, and a plain bootstrap of few is far too sure: it understates the variance between S of them by
(S - 1) / S, and its quantiles are those of many. So the draws of seeds are stretched about their mean by
sqrt(S / (S - 1)) times the ratio of the quantiles of Student's t with S - 1 degrees of freedom and of the normal
distribution: 1.6 with five seeds, 2.7 with three. Of 95% intervals of seeds' noise alone, 95%, 94% and 93% then hold
the truth with five, three and two seeds; of plain ones 84%, 73% and 51%. With one seed there is no such variance: the
interval is of the episodes alone, and tells nothing about another training. Tables say so.

Noise of a single seed in a single episode, such as what is left of the draw of actions, is counted by the seeds, by the
episodes and by both together, so that intervals are too wide where it dominates (Owen, The pigeonhole bootstrap, 2007).
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

REPLICATES: Final = 4000
CONFIDENCE: Final = 0.95
_SEED: Final = 2109


class Interval(NamedTuple):
    """A difference and its confidence interval, in the unit of the values."""

    difference: float
    low: float
    high: float


class Resampling:
    """The draws of all replicates, the same for every comparison of some episodes.

    Args:
        episodes: E, number of episodes.
        replicates: B.
        seed: Of the draws.
    """

    def __init__(self, episodes: int, replicates: int = REPLICATES, seed: int = _SEED) -> None:
        self._rng_seed = seed
        self._replicates = replicates
        rng = np.random.default_rng([seed, episodes])
        counts = rng.multinomial(episodes, np.full(episodes, 1.0 / episodes), size=replicates)
        self._episode_weights = (counts / episodes).astype(np.float32)  # [B, E]; each row sums to 1

    def interval(
        self,
        row: NDArray[np.float64],
        reference: NDArray[np.float64],
        *,
        same_seeds: bool,
        confidence: float = CONFIDENCE,
    ) -> Interval:
        """Compare a row with a reference.

        Args:
            row: Mean over trials of each seed and episode, [S, E].
            reference: The same of the reference, [R, E].
            same_seeds: Whether seed i of one is seed i of the other; S = R then.
            confidence: Share of the replicates within the interval.

        Returns:
            Difference of the means, row - reference, with its percentile interval.
        """
        difference = float(row.mean() - reference.mean())
        if same_seeds:
            draws = self._means(row - reference, 0, confidence)
        else:
            draws = self._means(row, 0, confidence) - self._means(reference, 1, confidence)
        low, high = np.quantile(draws, [(1 - confidence) / 2, (1 + confidence) / 2])
        return Interval(difference, float(low), float(high))

    def _means(self, values: NDArray[np.float64], stream: int, confidence: float) -> NDArray[np.float64]:
        """Return the mean of each replicate, [B], of values [S, E]; equal streams and S draw equal seeds."""
        seeds = len(values)
        rng = np.random.default_rng([self._rng_seed, seeds, stream])
        weights = rng.multinomial(seeds, np.full(seeds, 1.0 / seeds), size=self._replicates) / seeds  # [B, S]
        weights = 1.0 / seeds + stretch(seeds, confidence) * (weights - 1.0 / seeds)
        of_seeds = self._episode_weights @ values.T.astype(np.float32)  # [B, S]
        return np.asarray((weights * of_seeds).sum(axis=1), dtype=np.float64)


def stretch(seeds: int, confidence: float) -> float:
    """Return by how much draws of some seeds are too close to their mean."""
    if seeds == 1:
        return 1.0
    upper = (1 + confidence) / 2
    return float((seeds / (seeds - 1)) ** 0.5 * stats.t.ppf(upper, seeds - 1) / stats.norm.ppf(upper))
