"""Trials: the same episodes again and again, with actions drawn from another seed each time."""

import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hoz_dist.evaluation.agents import Agent
from hoz_dist.nav.episode import Episode, EpisodeResult
from hoz_dist.nav.metrics import Metrics, long_episodes, metrics_of
from hoz_dist.sim.episode_runner import EpisodeRunner
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_source import StoredViews, ViewSource

SourceFactory = Callable[[], AbstractContextManager[ViewSource]]
"""Makes a new source of observations, which is closed after use."""


def stored_views() -> AbstractContextManager[ViewSource]:
    """Make a source of stored views."""
    return nullcontext(StoredViews())


@dataclass(frozen=True)
class Evaluation:
    """The results of an agent's trials."""

    method: str
    split: str
    trials: tuple[tuple[EpisodeResult, ...], ...]
    """Results of every episode, in the order of the list, for each trial."""

    @property
    def episodes(self) -> int:
        """Number of episodes of a trial."""
        return len(self.trials[0])

    def of_scene(self, scene: str) -> "Evaluation":
        """Return the part of the results that one scene has."""
        trials = tuple(tuple(r for r in trial if r.room.scene == scene) for trial in self.trials)
        return Evaluation(self.method, self.split, trials)

    def to_json(self) -> dict[str, Any]:
        """Return means and standard deviations over trials, in percent, for all episodes and the long ones."""
        return {
            "method": self.method,
            "split": self.split,
            "episodes": self.episodes,
            "trials": len(self.trials),
            "all": _spread([metrics_of(trial) for trial in self.trials]),
            "long": _spread([metrics_of(long_episodes(trial)) for trial in self.trials]),
        }


def run_trials(
    agent: Agent,
    rooms: Sequence[RoomViews],
    episodes: Sequence[Episode],
    seeds: Iterable[int],
    *,
    split: str,
    source: SourceFactory = stored_views,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Run an agent over all episodes, once for each seed.

    Args:
        agent: Who acts.
        rooms: The rooms of the episodes.
        episodes: What to run; every one counts.
        seeds: Seed of the actions of each trial.
        split: The split that the rooms belong to, for the report.
        source: Makes the source of a trial's observations: stored views, or PyBullet at every step.
        progress: Called with the number of episodes that have ended and the number of all.
    """
    all_seeds = list(seeds)
    total = len(all_seeds) * len(episodes)
    trials = []
    for number, seed in enumerate(all_seeds):
        with source() as views:
            runner = EpisodeRunner(rooms, episodes, source=views)
            for _ in play(agent, runner, seed):
                if progress is not None:
                    progress(number * len(episodes) + int((~runner.active).sum()), total)
        trials.append(tuple(runner.results()))
    return Evaluation(agent.name, split, tuple(trials))


def play(agent: Agent, runner: EpisodeRunner, seed: int) -> Iterator[NDArray[np.int64]]:
    """Run all episodes to their ends; after each step, yield the actions that were chosen, [B].

    Args:
        agent: Who acts.
        runner: The episodes, none of which has made a step yet.
        seed: Seed of the actions.
    """
    agent.begin(runner, np.random.default_rng(seed))
    while runner.active.any():
        actions = agent.act(runner)
        runner.step(actions)
        yield actions


def _spread(metrics: list[Metrics]) -> dict[str, Any]:
    """Mean and standard deviation over trials (0 for a single one), in percent."""

    def of(values: list[float]) -> dict[str, float]:
        deviation = statistics.stdev(values) if len(values) > 1 else 0.0
        return {"mean": round(100 * statistics.fmean(values), 2), "std": round(100 * deviation, 2)}

    return {
        "episodes": metrics[0].episodes,
        "sr": of([m.sr for m in metrics]),
        "spl": of([m.spl for m in metrics]),
        "sae": of([m.sae for m in metrics]),
    }
