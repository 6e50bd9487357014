"""`hoz-dist analyse`: why episodes of runs fail, where SPL is lost, and what the graph did."""

import json
from collections import Counter
from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Final

import click

from hoz_dist.atomic import check_writable, replace_file, write_atomically
from hoz_dist.cli.options import cache_option, echo_json, trial_options, weights_option
from hoz_dist.errors import InvalidValueError

if TYPE_CHECKING:
    from hoz_dist.cli.analysing.tracing import TracedRuns

_FIGURES: Final = "analysis.json"
_PICTURES: Final = ("failures.png", "success-by-length.png", "learning-curves.png", "trajectories.png")


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
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for analysis.json and pictures; made if need be, and what it has of these is replaced.  "
    "[default: none, the figures are only printed]",
)
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

    if out is not None:
        _make_folder(out)
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
    try:
        if out is not None:
            write_atomically(out / _FIGURES, f"{json.dumps(results, indent=2)}\n".encode(), overwrite=True)
    finally:  # whatever the disk says: figures take long, and must not be lost
        if as_json:
            echo_json(results)
        else:
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
    if out is not None:
        _draw(traced, out, rooms)


def _counts(methods: Iterable[str]) -> str:
    """Say how many runs each method has."""
    return ", ".join(f"{name} {runs}" for name, runs in Counter(methods).items())


def _make_folder(folder: Path) -> None:
    """Make the folder of results, and check that files can be written there, before hours of episodes.

    Raises:
        HozError: They cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in (_FIGURES, *_PICTURES):
            check_writable(folder / name, overwrite=True)
        with TemporaryFile(dir=folder):
            pass
    except OSError as error:
        message = f"Nothing can be written to '{folder}' ({error.strerror}); choose another folder by --out."
        raise InvalidValueError(message) from error


def _draw(traced: "TracedRuns", folder: Path, rooms: str) -> None:
    from hoz_dist.cli.analysing.side_by_side import MOST_AGENTS, side_by_side
    from hoz_dist.viz.analysis import failure_figure, learning_figure, length_figure
    from hoz_dist.viz.trajectory import draw_trajectories
    from hoz_dist.viz.zones import png

    failures, lengths, learning, trajectories = (folder / name for name in _PICTURES)
    methods = traced.methods
    write_atomically(failures, png(failure_figure(methods, rooms)), overwrite=True)
    write_atomically(lengths, png(length_figure(methods, rooms)), overwrite=True)
    if traced.curves:
        write_atomically(learning, png(learning_figure(traced.curves)), overwrite=True)
    shown = dict(islice(traced.shown.items(), MOST_AGENTS))
    ways = side_by_side(traced.benchmark, shown)
    replace_file(trajectories, lambda temporary: draw_trajectories(ways, temporary, len(shown)))
