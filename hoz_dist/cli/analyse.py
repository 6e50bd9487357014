"""`hoz-dist analyse`: why episodes of runs fail, where SPL is lost, and what the graph did."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hoz_dist.cli.options import cache_option, echo_json, trial_options, weights_option
from hoz_dist.errors import InvalidValueError

if TYPE_CHECKING:
    from hoz_dist.cli.analysing.tracing import TracedRuns


@click.command("analyse")
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=click.Path(path_type=Path))
@trial_options(trials=1)
@click.option("--long", "only_long", is_flag=True, help="Show the episodes with L* >= 5 alone in the table.")
@click.option(
    "--curve",
    is_flag=True,
    help="Also measure each checkpoint that a run folder keeps, by the same trials, for frames to SR 50 and 70; in "
    "validation rooms only.",
)
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for pictures and analysis.json.")
@weights_option
@cache_option
@click.option("--json", "as_json", is_flag=True, help="Print JSON, all episodes and the long ones, instead of a table.")
def analyse_command(
    runs: tuple[Path, ...],
    split: str,
    trials: int,
    seed: int,
    episodes: int,
    scenes: tuple[str, ...],
    out: Path | None,
    weights: Path | None,
    cache: Path | None,
    *,
    only_long: bool,
    curve: bool,
    as_json: bool,
) -> None:
    """Say why episodes of each RUN fail, where SPL is lost, and what the graph did.

    RUN is a checkpoint file, or a run folder for its newest checkpoint; `reproduce` tests another one, which
    seed-N.choice-*.json beside the folder names. Runs that differ by their seed alone, and were
    trained equally long in the same rooms, count as one method. All of them run the same fixed episodes at the
    temperature that `evaluate` has by default, with Random and Oracle beside them. docs/analysis.md explains each
    figure.
    """
    if curve and split == "test":
        message = "--curve compares checkpoints, which is for validation rooms; leave out --curve or --split test."
        raise InvalidValueError(message)
    from hoz_dist.cli.analysing.results import results_of
    from hoz_dist.cli.analysing.runs import open_runs
    from hoz_dist.cli.analysing.tracing import trace_runs
    from hoz_dist.cli.consoles import result_console
    from hoz_dist.evaluation.analysis_table import analysis_table

    opened = open_runs(
        runs,
        split="test" if split == "test" else "val",
        episodes=episodes,
        scenes=scenes,
        weights=weights,
        cache=cache,
        with_kept=curve,
    )
    seeds = range(seed, seed + trials)
    traced = trace_runs(opened, seeds)
    results = results_of(opened, traced, episodes, seeds)
    rooms = f"{'validation' if split == 'val' else 'test'} rooms"
    if out is not None:
        _draw(traced, out, results, rooms)
    if as_json:
        echo_json(results)
        return
    shown = [analysis.long if only_long else analysis for analysis in traced.analyses]
    drawn = f"seed {seed}" if trials == 1 else f"seeds {seed} to {seeds[-1]}"
    table = analysis_table(
        [analysis for analysis in shown if analysis is not None],
        traced.curves,
        title=f"{len(traced.benchmark.episodes)} episodes on unseen {rooms}"
        + (", those with L* >= 5" if only_long else "")
        + f"; runs: {_counts(run.method for run in opened)}; trials of each: {trials} ({drawn})",
        caption="docs/analysis.md explains each figure",
    )
    result_console().print(table)


def _counts(methods: Iterable[str]) -> str:
    """Say how many runs each method has."""
    return ", ".join(f"{name} {runs}" for name, runs in Counter(methods).items())


def _draw(traced: "TracedRuns", folder: Path, results: Mapping[str, Any], rooms: str) -> None:
    from hoz_dist.atomic import replace_file, write_atomically
    from hoz_dist.cli.analysing.side_by_side import MOST_AGENTS, side_by_side
    from hoz_dist.viz.analysis import failure_figure, learning_figure, length_figure
    from hoz_dist.viz.trajectory import draw_trajectories
    from hoz_dist.viz.zones import png

    folder.mkdir(parents=True, exist_ok=True)
    methods = traced.methods
    figures = {"failures": failure_figure(methods, rooms), "success-by-length": length_figure(methods, rooms)}
    if traced.curves:
        figures["learning-curves"] = learning_figure(traced.curves)
    for name, figure in figures.items():
        write_atomically(folder / f"{name}.png", png(figure), overwrite=True)
    shown = dict(islice(traced.shown.items(), MOST_AGENTS))
    ways = side_by_side(traced.benchmark, shown)
    replace_file(folder / "trajectories.png", lambda temporary: draw_trajectories(ways, temporary, len(shown)))
    write_atomically(folder / "analysis.json", f"{json.dumps(results, indent=2)}\n".encode(), overwrite=True)
