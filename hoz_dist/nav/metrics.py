"""SR, SPL and SAE over whole episodes."""

from collections.abc import Iterable
from typing import Final, NamedTuple

from hoz_dist.nav.episode import EpisodeResult

LONG_EPISODE: Final = 5
"""Episodes with L* of at least this many actions are "long" (L >= 5)."""


class Metrics(NamedTuple):
    """Success rate, success weighted by path length, success weighted by action efficiency; fractions in [0, 1]."""

    episodes: int
    sr: float
    spl: float
    sae: float


def spl_of(result: EpisodeResult) -> float:
    """Return S * L* / max(L, L*) of one episode, in actions without Done.

    A deviation from SPL in metres that the released code shares. An episode cannot be shorter than optimal, and
    L* is at least 1, since no episode starts at a pose that succeeds.
    """
    if not result.success:
        return 0.0
    taken = result.actions - int(result.said_done)
    return result.optimal / max(taken, result.optimal, 1)


def sae_of(result: EpisodeResult) -> float:
    """Return S * (MoveAhead actions / all actions, Done included) of one episode."""
    return result.moves / result.actions if result.success else 0.0


def metrics_of(results: Iterable[EpisodeResult]) -> Metrics:
    """Average the metrics over episodes; no episodes give zeros."""
    all_results = list(results)
    count = len(all_results)
    if count == 0:
        return Metrics(0, 0.0, 0.0, 0.0)
    return Metrics(
        episodes=count,
        sr=sum(result.success for result in all_results) / count,
        spl=sum(map(spl_of, all_results)) / count,
        sae=sum(map(sae_of, all_results)) / count,
    )


def long_episodes(results: Iterable[EpisodeResult]) -> list[EpisodeResult]:
    """Return the results whose L* is at least `LONG_EPISODE`."""
    return [result for result in results if result.optimal >= LONG_EPISODE]
