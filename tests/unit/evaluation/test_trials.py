import numpy as np
import pytest
from numpy.typing import NDArray

from hoz_dist.evaluation.agents import OracleAgent, RandomAgent
from hoz_dist.evaluation.benchmark import Benchmark
from hoz_dist.nav.actions import Action
from hoz_dist.nav.metrics import long_episodes
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.episode_runner import EpisodeRunner
from tests.unit.sim.making import random_views

ROOMS = tuple(
    random_views(RoomId(scene, 21), seed=n, width=6, depth=6) for n, scene in enumerate(("kitchen", "bathroom"))
)


@pytest.fixture
def benchmark() -> Benchmark:
    return Benchmark.of(ROOMS, "val", 150)


class HastyAgent:
    """Says Done at once."""

    name = "hasty"

    def begin(self, runner: EpisodeRunner, rng: np.random.Generator) -> None:
        del rng
        self.batch = len(runner.episodes)

    def act(self, runner: EpisodeRunner) -> NDArray[np.int64]:
        del runner
        return np.full(self.batch, int(Action.DONE))


def test_oracle_is_the_ceiling(benchmark: Benchmark) -> None:
    figures = benchmark.run(OracleAgent(list(ROOMS)), [0]).to_json()
    assert figures["all"]["sr"] == {"mean": 100.0, "std": 0.0}
    assert figures["all"]["spl"]["mean"] == 100.0
    assert figures["long"]["episodes"] == len(long_episodes(benchmark.run(HastyAgent(), [0]).trials[0]))


def test_done_at_once_never_succeeds(benchmark: Benchmark) -> None:
    assert benchmark.run(HastyAgent(), [0]).to_json()["all"]["sr"]["mean"] == 0.0


def test_every_episode_counts_in_every_trial(benchmark: Benchmark) -> None:
    evaluation = benchmark.run(RandomAgent(), [1, 2, 3])
    assert evaluation.episodes == 300
    for trial in evaluation.trials:
        assert [(result.room, result.target, result.optimal) for result in trial] == [
            (episode.room, episode.target, episode.optimal) for episode in benchmark.episodes
        ]
    assert evaluation.of_scene("kitchen").episodes == 150


def test_one_seed_gives_the_same_results_and_another_gives_others(benchmark: Benchmark) -> None:
    first, again, other = (benchmark.run(RandomAgent(), [seed]) for seed in (7, 7, 8))
    assert first.trials == again.trials != other.trials


def test_spread_over_trials_is_the_sample_standard_deviation(benchmark: Benchmark) -> None:
    evaluation = benchmark.run(RandomAgent(), [1, 2, 3])
    rates = [100 * np.mean([result.success for result in trial]) for trial in evaluation.trials]
    figures = evaluation.to_json()["all"]["sr"]
    assert figures["mean"] == pytest.approx(np.mean(rates), abs=0.01)
    assert figures["std"] == pytest.approx(np.std(rates, ddof=1), abs=0.01)
