"""What `hoz-dist analyse` writes as JSON: the figures, and what they are of."""

from collections.abc import Sequence
from typing import Any

from hoz_dist import __version__
from hoz_dist.cli.analysing.runs import Run
from hoz_dist.cli.analysing.tracing import TracedRuns
from hoz_dist.config import RunConfig
from hoz_dist.evaluation.analysis import Analysis
from hoz_dist.evaluation.analysis_table import MILESTONES
from hoz_dist.evaluation.learning_curve import LearningCurve, frames_to
from hoz_dist.evaluation.protocol import EPISODE_SEED, TEMPERATURE


def results_of(runs: Sequence[Run], traced: TracedRuns, episodes: int, seeds: Sequence[int]) -> dict[str, Any]:
    """Return all figures as JSON values, with what a reader needs to get them again.

    Args:
        runs: What was analysed.
        traced: What came of it.
        episodes: Number of episodes in each scene.
        seeds: Seed of each trial.
    """
    benchmark = traced.benchmark
    return {
        "version": __version__,
        "split": benchmark.split,
        "parameters": {
            "scenes": list(benchmark.scenes),
            "episodes_per_scene": episodes,
            "episode_seed": EPISODE_SEED,
            "trials": len(seeds),
            "seeds": list(seeds),
            "temperature": TEMPERATURE,
        },
        "runs": [_run(run) for run in runs],
        "methods": {analysis.name: _parts(analysis) for analysis in traced.analyses},
        "curves": {name: [_curve(curve) for curve in curves] for name, curves in traced.curves.items()},
    }


def _run(run: Run) -> dict[str, Any]:
    checkpoint = run.checkpoint
    default = RunConfig(method=checkpoint.config.method, seed=checkpoint.config.seed).to_json()
    return {
        "path": str(run.path),
        "method": run.method,
        "checkpoint": checkpoint.file_name,
        "version": checkpoint.version,
        "frames": checkpoint.frames,
        "seed": checkpoint.config.seed,
        "options": {name: value for name, value in checkpoint.config.to_json().items() if value != default[name]},
    }


def _parts(analysis: Analysis) -> dict[str, Any]:
    return {"all": analysis.to_json(), "long": None if analysis.long is None else analysis.long.to_json()}


def _curve(curve: LearningCurve) -> dict[str, Any]:
    return {**curve._asdict(), "frames_to": {f"{rate:.0f}": frames_to(curve, rate) for rate in MILESTONES}}
