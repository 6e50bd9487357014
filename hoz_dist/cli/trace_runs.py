"""From runs to analysed episodes, with the progress shown: what `hoz-dist analyse` works with."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple

from hoz_dist.cli.measure import agent_of, open_benchmark
from hoz_dist.cli.progress import Progress
from hoz_dist.config import RunConfig
from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.evaluation.agents import Agent, OracleAgent, RandomAgent
from hoz_dist.evaluation.analysis import Analysis
from hoz_dist.evaluation.benchmark import Benchmark
from hoz_dist.evaluation.episode_analysis import EpisodeAnalysis, analyse_episodes
from hoz_dist.evaluation.learning_curve import LearningCurve
from hoz_dist.evaluation.trace import EpisodeTrace, trace_episodes
from hoz_dist.nav.metrics import metrics_of
from hoz_dist.nav.rooms import Split
from hoz_dist.viz.trajectory import Trajectory, trajectories_of
from learner.checkpoint import Checkpoint, kept_checkpoints, load_checkpoint

_MOST_COLUMNS: Final = 4
"""Agents whose ways are drawn side by side."""


class Run(NamedTuple):
    """A run that is to be analysed."""

    method: str
    """Its name in tables and pictures; runs that differ by their seed alone share it."""
    checkpoint: Checkpoint
    kept: tuple[Path, ...]
    """The checkpoints of its curve, by version; none when no curve is wanted."""
    benchmark: Benchmark
    """Its episodes, those of the other runs too, in rooms as its own encoder sees them."""


@dataclass(frozen=True)
class TracedRuns:
    """What came of it."""

    benchmark: Benchmark
    random: Analysis
    methods: tuple[Analysis, ...]
    oracle: Analysis
    curves: dict[str, list[LearningCurve]]
    """Curves of each run, by method; empty when no curve is wanted."""
    shown: dict[str, list[EpisodeTrace]]
    """One trial of the first run of each method; of a single method's beside the oracle's."""

    @property
    def analyses(self) -> tuple[Analysis, ...]:
        """The methods between the floor and the ceiling."""
        return self.random, *self.methods, self.oracle

    def side_by_side(self) -> list[Trajectory]:
        """Return the ways of all shown agents in one episode of each scene, agent by agent.

        The longest episode by L* that one agent wins and another loses; if there is none, the longest.
        """
        episodes, trials = self.benchmark.episodes, list(self.shown.values())

        def telling(slot: int) -> tuple[bool, int]:
            return len({trial[slot].result.success for trial in trials}) > 1, episodes[slot].optimal

        chosen = [
            max((slot for slot, episode in enumerate(episodes) if episode.room.scene == scene), key=telling)
            for scene in self.benchmark.scenes
        ]
        ways = [
            trajectories_of([trial[slot] for slot in chosen], self.benchmark.rooms, name)
            for name, trial in self.shown.items()
        ]
        return [way for of_episode in zip(*ways, strict=True) for way in of_episode]


def open_runs(
    paths: Sequence[Path],
    *,
    split: Split,
    episodes: int,
    scenes: Sequence[str],
    weights: Path | None,
    cache: Path | None,
    with_kept: bool,
) -> list[Run]:
    """Read runs and draw their episodes.

    Args:
        paths: Run folders or checkpoints, at least one.
        split: Rooms to use.
        episodes: Number of episodes in each scene.
        scenes: Scenes; those that the runs were trained in when there are none.
        weights: Weights of the resnet18 encoder.
        cache: Folder of the view store; the default one when None.
        with_kept: Whether curves are wanted.

    Raises:
        HozError: A run cannot be read, keeps no checkpoint, or the runs cannot have the same episodes.
    """
    checkpoints = [load_checkpoint(path) for path in paths]
    kept = [_kept(path) if with_kept else () for path in paths]
    names = method_names(paths, [checkpoint.config for checkpoint in checkpoints])
    benchmarks = [
        open_benchmark(checkpoint, split=split, episodes=episodes, scenes=scenes, weights=weights, cache=cache)
        for checkpoint in checkpoints
    ]
    for path, benchmark in zip(paths, benchmarks, strict=True):
        if benchmark.episodes != benchmarks[0].episodes:
            message = (
                f"'{paths[0]}' and '{path}' have different episodes, because of their scenes or the size of their "
                "pictures; name common scenes by --scene, or analyse them one by one."
            )
            raise InvalidValueError(message)
    return [Run(*parts) for parts in zip(names, checkpoints, kept, benchmarks, strict=True)]


def method_names(paths: Sequence[Path], configs: Sequence[RunConfig]) -> list[str]:
    """Name runs by their methods and the layers that these lack; where that does not tell apart, by their paths too.

    Args:
        paths: Of the runs.
        configs: Their configurations.

    Returns:
        A name for each run; the same for runs whose configurations differ by the seed, and by the seed alone.
    """
    alike: dict[RunConfig, list[int]] = {}
    for number, config in enumerate(configs):
        alike.setdefault(replace(config, seed=0), []).append(number)
    first = list(range(len(configs)))
    for numbers in alike.values():
        # Several checkpoints of one run are no more than one seed, and stay apart.
        if len({configs[number].seed for number in numbers}) == len(numbers):
            for number in numbers:
                first[number] = numbers[0]
    names = ["-no-".join((config.method, *config.without)) for config in configs]
    ambiguous = {names[one] for one in first for other in first if one != other and names[one] == names[other]}
    return [f"{names[one]} ({paths[one]})" if names[one] in ambiguous else names[one] for one in first]


def _kept(path: Path) -> tuple[Path, ...]:
    """Return the checkpoints of a run's curve.

    Raises:
        NotFoundError: There is none.
        UnreadableError: The folder cannot be read now.
    """
    kept = kept_checkpoints(path)
    if not kept:
        message = f"'{path}' keeps no checkpoint for a curve; give a run folder that was trained with --keep-every."
        raise NotFoundError(message)
    return kept


def trace_runs(runs: Sequence[Run], seeds: Sequence[int]) -> TracedRuns:
    """Run the agents of runs, Random and Oracle over the episodes, and analyse them.

    Args:
        runs: At least one.
        seeds: Seed of each trial; Random has the first alone, and Oracle draws nothing.
    """
    import torch

    # Results do not depend on the number of cores, and small products gain nothing from more threads.
    torch.set_num_threads(1)
    benchmark = runs[0].benchmark
    trials: dict[str, list[tuple[EpisodeAnalysis, ...]]] = {}
    shown: dict[str, list[EpisodeTrace]] = {}
    curves: dict[str, list[LearningCurve]] = {}
    total = 2 + sum(len(seeds) + len(run.kept) for run in runs)
    with _Episodes(total * len(benchmark.episodes)) as episodes:

        def analyse(agent: Agent, name: str, rooms: Benchmark, seed: int) -> list[EpisodeTrace]:
            traces = episodes.trace(agent, name, rooms, seed)
            trials.setdefault(name, []).append(tuple(analyse_episodes(traces, rooms.rooms)))
            return traces

        analyse(RandomAgent(), RandomAgent.name, benchmark, seeds[0])
        for run in runs:
            for seed in seeds:
                traces = analyse(agent_of(run.checkpoint), run.method, run.benchmark, seed)
                shown.setdefault(run.method, traces)
            if run.kept:
                curves.setdefault(run.method, []).append(_curve(run, episodes))
        traces = analyse(OracleAgent(list(benchmark.rooms)), OracleAgent.name, benchmark, seeds[0])
        if len(shown) == 1:
            shown[OracleAgent.name] = traces
    analyses = {name: Analysis(name, tuple(of_method)) for name, of_method in trials.items()}
    return TracedRuns(
        benchmark=benchmark,
        random=analyses.pop(RandomAgent.name),
        oracle=analyses.pop(OracleAgent.name),
        methods=tuple(analyses.values()),
        curves=curves,
        shown=dict(list(shown.items())[:_MOST_COLUMNS]),
    )


class _Episodes(Progress):
    """Runs agents over episodes, and shows how many of all have ended."""

    def __init__(self, total: int) -> None:
        super().__init__("Evaluating", total, "episodes")
        self._before = 0

    def trace(self, agent: Agent, name: str, benchmark: Benchmark, seed: int) -> list[EpisodeTrace]:
        """Run one trial."""

        def report(ended: int) -> None:
            self.update(self._before + ended, name)

        traces = trace_episodes(agent, benchmark.rooms, benchmark.episodes, seed, report)
        self._before += len(benchmark.episodes)
        return traces


def _curve(run: Run, episodes: _Episodes) -> LearningCurve:
    """Measure the kept checkpoints of a run."""
    frames, success = [], []
    for file in run.kept:
        checkpoint = load_checkpoint(file)
        traces = episodes.trace(agent_of(checkpoint), f"{run.method}, version {checkpoint.version}", run.benchmark, 0)
        frames.append(checkpoint.frames)
        success.append(100.0 * metrics_of(trace.result for trace in traces).sr)
    return LearningCurve(tuple(frames), tuple(success))
