"""Learning: whether the policy learns as well whatever travels on the wire, over several seeds.

python -m tests.campaigns.learning --folder runs/learning

Each way of training is run with the same seeds by `hoz-dist train`; checkpoints along the way are measured on the
validation rooms. Finished runs are kept, so that the same command goes on after an interruption.
"""

import json
import statistics
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import click
import torch
from matplotlib.figure import Figure
from scipy import stats

from hoz_dist.evaluation.benchmark import Benchmark
from hoz_dist.evaluation.loading import load_agent, matching_encoder
from hoz_dist.nav.categories import SCENES
from hoz_dist.nav.metrics import metrics_of
from hoz_dist.nav.rooms import rooms_of
from hoz_dist.sim.view_store import ViewStore, default_cache
from hoz_dist.wire.transport.environment import child_environment
from learner.checkpoint import KEPT_SUFFIX, SUFFIX, load_checkpoint

WAYS: Final[Mapping[str, tuple[str, ...]]] = {
    "fp32": (),
    "bf16": ("--compress", "bf16"),
    "int8": ("--compress", "int8"),
    "topk": ("--compress", "topk"),
    "delta": ("--parameters", "delta"),
    "rollouts": ("--learn-from", "rollouts"),
    "products": ("--precision", "bf16"),
}
"""Options of each way of training; the first is what the others are compared with."""
CHECKPOINTS: Final = 20
"""Checkpoints along a run."""
LAST: Final = 5
"""Of these the mean is taken."""
EARLY_STRIDE: Final = 2
"""Of the earlier ones, for the curve, every second is measured."""
CONFIDENCE: Final = 0.95


@dataclass(frozen=True)
class Curve:
    """Success along one run."""

    frames: tuple[int, ...]
    success: tuple[float, ...]
    """SR on the validation rooms, percent, at each of them."""

    @property
    def end(self) -> float:
        """Mean SR of the last checkpoints, percent."""
        return statistics.fmean(self.success[-LAST:])


def train(folder: Path, options: Sequence[str], seed: int, frames: int, actors: int) -> None:
    """Train one run, or go on with it."""
    words = ["train", "--run", str(folder), "--seed", str(seed), "--frames", str(frames), "--actors", str(actors)]
    words += ["--episodes", "0", "--keep-every", str(frames // CHECKPOINTS), *options]
    with folder.with_suffix(".log").open("ab") as log:
        subprocess.run(
            [sys.executable, "-m", "hoz_dist.cli.main", *words],
            check=True,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            env=child_environment(),
        )


def measure(folder: Path, episodes: int) -> Curve:
    """Measure the kept checkpoints of a run.

    Args:
        folder: The run's.
        episodes: Validation episodes in each scene, the same ones for every checkpoint.
    """
    kept = sorted(folder.glob(f"checkpoints/*{KEPT_SUFFIX}"))
    chosen = [*kept[:-LAST:EARLY_STRIDE], *kept[-LAST:]]
    frames, success = [], []
    benchmark: Benchmark | None = None
    for file in chosen:
        checkpoint = load_checkpoint(file.with_suffix(SUFFIX))
        config = checkpoint.config
        if benchmark is None:
            store, encoder = ViewStore(default_cache(), config.picture_size), matching_encoder(config, None)
            names = [room for scene in SCENES for room in rooms_of(scene, "val")]
            benchmark = Benchmark.of([store.open(room, encoder) for room in names], "val", episodes)
        agent = load_agent(config, checkpoint.parameters, checkpoint.scene_graphs())
        (trial,) = benchmark.run(agent, [0]).trials
        frames.append(checkpoint.frames)
        success.append(100.0 * metrics_of(trial).sr)
    return Curve(tuple(frames), tuple(success))


def compare(curves: Mapping[str, Mapping[int, Curve]]) -> dict[str, Any]:
    """Compare each way with the first one, paired by seed.

    Args:
        curves: By way and seed.

    Returns:
        By way: the mean SR of the last checkpoints, and the difference with its confidence interval, percent points.
    """
    reference = next(iter(curves.values()))
    summary = {}
    for way, by_seed in curves.items():
        ends = [curve.end for curve in by_seed.values()]
        row: dict[str, Any] = {"seeds": len(ends), "sr": statistics.fmean(ends), "of_seeds": ends}
        differences = [curve.end - reference[seed].end for seed, curve in by_seed.items() if seed in reference]
        if by_seed is not reference and len(differences) > 1:
            mean, error = statistics.fmean(differences), stats.sem(differences)
            low, high = stats.t.interval(CONFIDENCE, len(differences) - 1, mean, error)
            row |= {"difference": mean, "low": float(low), "high": float(high)}
        summary[way] = row
    return summary


def plot(curves: Mapping[str, Mapping[int, Curve]]) -> Figure:
    """Draw success against frames, the mean over seeds."""
    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    axes = figure.add_subplot(xlabel="frames (millions)", ylabel="success on validation rooms (%)")
    for way, by_seed in curves.items():
        # All runs of a way have checkpoints at the same milestones.
        shortest = min(len(curve.frames) for curve in by_seed.values())
        frames = [statistics.fmean(curve.frames[i] for curve in by_seed.values()) / 1e6 for i in range(shortest)]
        success = [statistics.fmean(curve.success[i] for curve in by_seed.values()) for i in range(shortest)]
        axes.plot(frames, success, label=way)
    axes.grid(alpha=0.3)
    axes.legend()
    return figure


@click.command()
@click.option("--folder", type=click.Path(path_type=Path), required=True, help="For all files.")
@click.option("--way", "ways", multiple=True, type=click.Choice(list(WAYS)), help="Ways to train.  [default: all]")
@click.option("--seeds", type=int, default=5, show_default=True)
@click.option("--frames", type=int, default=2_000_000, show_default=True, help="Frames of a run.")
@click.option("--actors", type=int, default=2, show_default=True)
@click.option("--episodes", type=int, default=150, show_default=True, help="Validation episodes in each scene.")
def main(folder: Path, ways: tuple[str, ...], seeds: int, frames: int, actors: int, episodes: int) -> None:
    """Train in every way with every seed, measure, and write results.json and curves.png."""
    torch.set_num_threads(1)
    folder.mkdir(parents=True, exist_ok=True)
    reference = next(iter(WAYS))
    chosen = [way for way in WAYS if way in (ways or WAYS) or way == reference]
    settings = {"frames": frames, "actors": actors, "episodes": episodes}
    curves: dict[str, dict[int, Curve]] = {}
    # Seed by seed, so that whenever this is interrupted the ways have seen the same seeds.
    for seed in range(seeds):
        for way in chosen:
            run = folder / f"{way}-{seed}"
            result = run.with_suffix(".json")
            if not result.exists():
                train(run, WAYS[way], seed, frames, actors)
                curve = measure(run, episodes)
                measured = {"settings": settings, "frames": curve.frames, "success": curve.success}
                result.write_text(json.dumps(measured), encoding="utf-8")
            values = json.loads(result.read_text(encoding="utf-8"))
            if values["settings"] != settings:
                message = f"{result} is of other settings ({values['settings']}); give another --folder."
                raise click.UsageError(message)
            curves.setdefault(way, {})[seed] = Curve(tuple(values["frames"]), tuple(values["success"]))
            click.echo(f"{way}, seed {seed}: {curves[way][seed].end:.1f}")
    results: dict[str, Any] = {
        "command": f"python -m tests.campaigns.learning --seeds {seeds} --frames {frames} --actors {actors} "
        f"--episodes {episodes}",
        "ways": compare(curves),
        "curves": {
            way: {str(seed): {"frames": curve.frames, "success": curve.success} for seed, curve in by_seed.items()}
            for way, by_seed in curves.items()
        },
    }
    (folder / "results.json").write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    plot(curves).savefig(folder / "curves.png", dpi=120)
    for way, row in results["ways"].items():
        interval = (
            f"  difference {row['difference']:+.1f} [{row['low']:+.1f}, {row['high']:+.1f}]" if "low" in row else ""
        )
        click.echo(f"{way:>9}: SR {row['sr']:.1f} over {row['seeds']} seeds{interval}")


if __name__ == "__main__":
    main()
