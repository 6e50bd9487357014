"""Confidence intervals of differences between rows: a bootstrap over seeds, rooms and episodes.

A figure is uncertain because other seeds would have trained other agents, because other rooms would have been unseen,
and because other episodes would have been drawn in them. In each replicate the rooms of every scene are drawn with
replacement, and in each drawn room its episodes. All rows of a table were tested on the same episodes, so a replicate
draws the *same* ones for both rows: what makes a room or an episode hard cancels out. Seeds are drawn independently of
them, by the mean of each over all episodes: each row's own, since two methods that were trained with the same number
have nothing in common that shows in their results (docs/decisions/intervals.md); but the same seeds for both rows when
these are the same agents, tested in two ways. Trials are not resampled: their mean enters.

Seeds are few, and a plain bootstrap of few is far too sure: it understates the variance between S of them by
(S - 1) / S, and its quantiles are those of many. So the draws of seeds are stretched about their mean by
sqrt(S / (S - 1)) times the ratio of the quantiles of Student's t and of the normal distribution, with the degrees of
freedom of Welch and Satterthwaite where either row has its own seeds. Of 95% intervals of seeds' noise alone, 93% to
98% then hold the truth with two to five seeds (89% with two noisy ones against five); of plain ones with five, three
and two seeds 84%, 73% and 51%. With one seed there is no such variance: the interval tells nothing about another
training. Tables say so.

What is left errs to the wide side: drawing both rooms and episodes counts some noise of episodes twice, and so do seeds
with the noise of single cells. In simulations with noise as in our tables 90% to 100% of intervals hold the truth; of
a bootstrap of episodes alone 63% to 99%, since rooms differ (`tests/unit/reproduce/test_bootstrap.py`).
"""

import math
from collections.abc import Sequence
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
        room: Index of each episode's room, [E].
        scene: Scene of each episode, [E]; rooms are drawn within scenes.
        replicates: B.
        seed: Of the draws.
    """

    def __init__(
        self,
        room: NDArray[np.int64],
        scene: NDArray[np.generic],
        replicates: int = REPLICATES,
        seed: int = _SEED,
    ) -> None:
        self._rng_seed = seed
        self._replicates = replicates
        rng = np.random.default_rng([seed, len(room)])
        counts = np.zeros((replicates, len(room)), dtype=np.float32)
        for one in np.unique(scene):
            rooms = np.unique(room[scene == one])
            drawn = rng.multinomial(len(rooms), np.full(len(rooms), 1.0 / len(rooms)), size=replicates)
            for times, number in zip(drawn.T, rooms, strict=True):
                episodes = np.flatnonzero((room == number) & (scene == one))
                # As many draws of its episodes as it has, for each time that the room was drawn.
                counts[:, episodes] = rng.multinomial(
                    times * len(episodes), np.full(len(episodes), 1.0 / len(episodes))
                )
        self._weights = counts / counts.sum(axis=1, keepdims=True)  # [B, E]; each row sums to 1

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
            same_seeds: Whether seed i of one is the same agent as seed i of the other; S = R then.
            confidence: Share of the replicates within the interval.

        Returns:
            Difference of the means, row - reference, with its percentile interval.
        """
        apart = row.mean(axis=0) - reference.mean(axis=0)
        draws = np.asarray(self._weights @ apart.astype(np.float32), dtype=np.float64)
        sides = [row - reference] if same_seeds else [row, reference]
        means = [side.mean(axis=1) for side in sides]
        freedom = degrees_of_freedom(means)
        for stream, (sign, of_seeds) in enumerate(zip((1.0, -1.0), means, strict=False)):
            draws += sign * stretch(len(of_seeds), freedom, confidence) * self._of_seeds(of_seeds, stream)
        low, high = np.quantile(draws, [(1 - confidence) / 2, (1 + confidence) / 2])
        return Interval(float(apart.mean()), float(low), float(high))

    def _of_seeds(self, means: NDArray[np.float64], stream: int) -> NDArray[np.float64]:
        """Return how far each replicate's seeds are from the mean of all, [B], of the means of seeds [S].

        Equal streams and S draw equal seeds.
        """
        seeds = len(means)
        rng = np.random.default_rng([self._rng_seed, seeds, stream])
        weights = rng.multinomial(seeds, np.full(seeds, 1.0 / seeds), size=self._replicates) / seeds  # [B, S]
        return np.asarray((weights - 1.0 / seeds) @ means)


def degrees_of_freedom(sides: Sequence[NDArray[np.float64]]) -> float:
    """Return those of the sum or difference of the means of samples, by Welch and Satterthwaite; of one, its S - 1.

    Args:
        sides: The means of the seeds of each side, [S]; one seed tells of no variance and is left out.

    Returns:
        Infinity when nothing varies.
    """
    several = [side for side in sides if len(side) > 1]
    variances = [float(side.var(ddof=1)) / len(side) for side in several]
    parts = sum(variance**2 / (len(side) - 1) for variance, side in zip(variances, several, strict=True))
    return sum(variances) ** 2 / parts if parts else math.inf


def stretch(seeds: int, freedom: float, confidence: float) -> float:
    """Return by how much draws of some seeds are too close to their mean."""
    if seeds == 1:
        return 1.0
    upper = (1 + confidence) / 2
    quantiles = stats.t.ppf(upper, freedom) / stats.norm.ppf(upper)
    return float((seeds / (seeds - 1)) ** 0.5 * quantiles)
