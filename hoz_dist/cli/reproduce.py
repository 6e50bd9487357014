"""`hoz-dist reproduce`: train, test and compare what a table of the paper compares."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from hoz_dist.cli.options import cache_option, echo_json, json_option
from hoz_dist.cli.reproducing.seeds import SeedsType, seeds_text
from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.reproduce.budget import BUDGETS, Budget

if TYPE_CHECKING:
    from hoz_dist.cli.reproducing.results import Results


def _figures(budget: Budget) -> str:
    """Say what a budget gives to each row."""
    seeds = "-".join(map(str, dict.fromkeys((budget.seeds, budget.more_seeds))))
    rooms, apartments = budget.room_frames / 1e6, budget.apartment_frames / 1e6
    return f"{budget.name}: {rooms:g}M frames in rooms, {apartments:g}M in apartments, {seeds} seeds"


@click.command("reproduce")
@click.argument("table", required=False)
@click.option(
    "--budget",
    default="quick",
    show_default=True,
    help=f"What every row gets. {'; '.join(map(_figures, BUDGETS.values()))}.",
)
@click.option(
    "--jobs",
    type=click.IntRange(1, 256),
    help="Runs at once, each a learner and an actor; before them, processes that render.  [default: number of cores]",
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("runs/reproduce"),
    show_default=True,
    help="Folder of runs and results; what it holds is not done again, whichever table it was for.",
)
@click.option(
    "--seeds",
    type=SeedsType(),
    help="Seeds of each row's runs: how many, from 0 on, or which, such as 5-14.  [default: as the budget says]",
)
@click.option("--row", "rows", multiple=True, help="Train (or list) this row only; may be repeated.  [default: all]")
@click.option("--estimate", is_flag=True, help="Train nothing: say how long it would take.")
@click.option("--collect", is_flag=True, help="Train nothing: make the table's files of what is finished.")
@click.option("--runs", is_flag=True, help="Train nothing: print the finished run folders, one a line.")
@click.option(
    "--docs",
    type=click.Path(file_okay=False, path_type=Path),
    help="Put Markdown, JSON and picture of the table into this folder, too.  [default: nowhere else]",
)
@cache_option
@json_option
def reproduce_command(
    table: str | None,
    budget: str,
    jobs: int | None,
    out: Path,
    seeds: range | None,
    rows: tuple[str, ...],
    docs: Path | None,
    cache: Path | None,
    *,
    estimate: bool,
    collect: bool,
    runs: bool,
    as_json: bool,
) -> None:
    """Make TABLE of the paper again: train what is missing, test it on unseen rooms, compare with intervals.

    Without TABLE, list the tables. It first says how long it takes. Ctrl-C or a kill loses nothing that is finished,
    and at most half a minute of training, or the test that was running; the same command goes on.
    """
    _refuse_contradictions(
        table,
        {"--estimate": estimate, "--collect": collect, "--runs": runs},
        {"--row": rows, "--docs": docs, "--seeds": seeds, "--jobs": jobs, "--out": _is_given("out")},
    )
    _refuse_unknown(table, budget, rows)
    from hoz_dist.cli.reproducing.listing import list_runs, list_tables
    from hoz_dist.reproduce.job import jobs_of, seeds_of
    from hoz_dist.reproduce.row import BASELINES
    from hoz_dist.reproduce.tables import TABLES

    spend = BUDGETS[budget]
    if table is None:
        list_tables(list(TABLES.values()), spend, as_json=as_json)
        return
    wanted = TABLES[table]
    if all(seeds == seeds_of(row, spend) for row in wanted.rows if row.agent not in BASELINES):
        seeds = None
    own_seeds = None if seeds is None else seeds_text(seeds)
    of_rows = {row.name: jobs_of(wanted, row, spend, seeds) for row in wanted.rows}
    chosen = [job for name, jobs_of_row in of_rows.items() if not rows or name in rows for job in jobs_of_row]
    if runs:
        list_runs(chosen, out, as_json=as_json)
        return
    from hoz_dist.cli.reproducing.results import Results

    if not collect:
        from hoz_dist.cli.reproducing.outcomes import read_outcomes
        from hoz_dist.cli.reproducing.work import alone, work_off

        # Before hours of training: what would fail after them.
        if docs is not None:
            docs.mkdir(parents=True, exist_ok=True)
        read_outcomes(of_rows, out)
        with alone(out):
            processes = jobs or len(os.sched_getaffinity(0))
            facts = {"table": table, "budget": budget, "seeds": own_seeds, "rows": list(rows)}
            finished = work_off(chosen, out, cache, processes, facts, only_estimate=estimate, as_json=as_json)
        if not finished:
            return
    command = f"hoz-dist reproduce {table} --budget {budget}" + (f" --seeds {own_seeds}" if own_seeds else "")
    results = Results.read(wanted, spend, command, of_rows, out, seeds=own_seeds)
    _show(results, out, docs, only_collect=collect, as_json=as_json)


def _is_given(option: str) -> bool:
    """Tell whether an option that has a default was given."""
    return click.get_current_context().get_parameter_source(option) is not ParameterSource.DEFAULT


def _refuse_contradictions(table: str | None, instead: Mapping[str, bool], of_table: Mapping[str, object]) -> None:
    """Refuse options of which one would be passed over.

    Args:
        table: The table, if one is named.
        instead: What is to be done in place of training, by option.
        of_table: What else is about one table, by option; empty or None when not given.

    Raises:
        InvalidValueError: There are such.
    """
    modes = [option for option, given in instead.items() if given]
    others = [option for option, given in of_table.items() if given]
    if table is None and (modes or others):
        option = [*modes, *others][0]
        message = f"{option} is about one table; name it: hoz-dist reproduce TABLE {option} ..."
        raise InvalidValueError(message)
    if len(modes) > 1:
        message = f"{modes[0]} and {modes[1]} are two things to do in place of training; leave out one of them."
        raise InvalidValueError(message)
    for mode, other, why in (
        ("--collect", "--row", "shows all rows"),
        ("--estimate", "--docs", "makes no files"),
        ("--runs", "--docs", "makes no files"),
        ("--collect", "--jobs", "runs nothing"),
        ("--runs", "--jobs", "runs nothing"),
    ):
        if mode in modes and other in others:
            message = f"{mode} {why}, so {other} has no meaning beside it; leave out one of them."
            raise InvalidValueError(message)


def _refuse_unknown(table: str | None, budget: str, rows: Sequence[str]) -> None:
    """Refuse names that do not exist.

    Raises:
        UnknownNameError: There are such.
    """
    from hoz_dist.reproduce.tables import TABLES

    if budget not in BUDGETS:
        raise UnknownNameError.of("budget", budget, BUDGETS)
    if table is None:
        return
    if table not in TABLES:
        raise UnknownNameError.of("table", table, TABLES)
    names = [row.name for row in TABLES[table].rows]
    for name in rows:
        if name not in names:
            raise UnknownNameError.of("row", name, names)


def _show(results: "Results", out: Path, docs: Path | None, *, only_collect: bool, as_json: bool) -> None:
    """Write the table's files, and print it.

    Raises:
        InvalidValueError: There is nothing to write, or it would replace files that have more results.
    """
    from hoz_dist.cli.reproducing.sessions import read_sessions

    if not results.summaries:
        message = (
            f"'{out}' has no results of '{results.stem}'; leave out --collect to make them, or choose another --out."
        )
        raise InvalidValueError(message)
    if only_collect:  # what was trained just now is written in any case
        results.refuse_to_replace_more(out)
    sessions = [one for one in read_sessions(out) if results.is_session(one)]
    paths = results.write(out, sessions)
    if docs is not None:
        results.refuse_to_replace_more(docs)
        paths += results.write(docs, sessions)
    if as_json:
        echo_json(results.to_json())
    else:
        click.echo(results.text())
    click.echo("Written: " + ", ".join(map(str, paths)), err=True)
