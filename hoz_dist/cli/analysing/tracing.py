"""Has the agents of runs act in the episodes, with the progress shown, and analyses what they do."""

from collections.abc import Sequence
from dataclasses import dataclass

from hoz_dist.cli.analysing.runs import Run
from hoz_dist.cli.measure import agent_of
from hoz_dist.cli.progress import Progress
from hoz_dist.evaluation.agents import Agent, OracleAgent, RandomAgent
from hoz_dist.evaluation.analysis import Analysis
from hoz_dist.evaluation.benchmark import Benchmark
from hoz_dist.evaluation.episode_analysis import EpisodeAnalysis, analyse_episodes
from hoz_dist.evaluation.learning_curve import LearningCurve
from hoz_dist.evaluation.trace import EpisodeTrace, trace_episodes
from hoz_dist.nav.metrics import metrics_of
from hoz_dist.policy.threads import use_one_thread
from learner.checkpoint import load_checkpoint


@dataclass(frozen=True)
class TracedRuns:
    """What the agents of all runs did in the same episodes."""

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


def trace_runs(runs: Sequence[Run], seeds: Sequence[int]) -> TracedRuns:
    """Run the agents of runs, Random and Oracle over the episodes, and analyse them.

    Args:
        runs: At least one.
        seeds: Seed of each trial; Random has the first alone, and Oracle draws nothing.
    """
    use_one_thread()
    benchmark = runs[0].benchmark
    trials: dict[str, list[tuple[EpisodeAnalysis, ...]]] = {}
    shown: dict[str, list[EpisodeTrace]] = {}
    curves: dict[str, list[LearningCurve]] = {}
    total = 2 + len(seeds) * sum(1 + len(run.kept) for run in runs)
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
                curves.setdefault(run.method, []).append(_curve(run, episodes, seeds))
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
        shown=shown,
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


def _curve(run: Run, episodes: _Episodes, seeds: Sequence[int]) -> LearningCurve:
    """Measure the kept checkpoints of a run, by as many trials as the run itself."""
    frames, success = [], []
    for file in run.kept:
        checkpoint = load_checkpoint(file)
        agent, name = agent_of(checkpoint), f"{run.method}, version {checkpoint.version}"
        trials = [episodes.trace(agent, name, run.benchmark, seed) for seed in seeds]
        frames.append(checkpoint.frames)
        success.append(100.0 * metrics_of(trace.result for trial in trials for trace in trial).sr)
    return LearningCurve(tuple(frames), tuple(success))
