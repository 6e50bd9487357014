"""`hoz-dist reproduce`: train, test and compare what a table of the paper compares."""

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hoz_dist.cli.options import cache_option, echo_json, json_option
from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.reproduce.budget import BUDGETS, Budget

if TYPE_CHECKING:
    from hoz_dist.reproduce.job import Job
    from hoz_dist.reproduce.row import Table


def _figures(budget: Budget) -> str:
    """Say what a budget gives to each row."""
    seeds = "-".join(map(str, dict.fromkeys((budget.seeds, budget.key_seeds))))
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
    "--jobs", type=click.IntRange(1, 256), help="Runs at once, each a learner and an actor.  [default: number of cores]"
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("runs/reproduce"),
    show_default=True,
    help="Folder of runs and results; what it holds is not done again, whichever table it was for.",
)
@click.option("--seeds", type=click.IntRange(1, 100), help="Training runs of each row.  [default: as the budget says]")
@click.option("--row", "rows", multiple=True, help="Train this row only; may be repeated.  [default: all]")
@click.option("--estimate", is_flag=True, help="Train nothing: say how long it would take.")
@click.option("--collect", is_flag=True, help="Train nothing: make the table's files of what is finished.")
@click.option(
    "--docs",
    type=click.Path(file_okay=False, path_type=Path),
    help="Put Markdown, JSON and picture of the table into this folder, too.",
)
@cache_option
@json_option
def reproduce_command(
    table: str | None,
    budget: str,
    jobs: int | None,
    out: Path,
    seeds: int | None,
    rows: tuple[str, ...],
    docs: Path | None,
    cache: Path | None,
    *,
    estimate: bool,
    collect: bool,
    as_json: bool,
) -> None:
    """Make TABLE of the paper again: train what is missing, test it on unseen rooms, compare with intervals.

    Without TABLE, list the tables. It first says how long it takes. Ctrl-C or a kill loses nothing that is finished,
    and at most half a minute of training, or the test that was running; the same command goes on.
    """
    from hoz_dist.reproduce.tables import TABLES

    if budget not in BUDGETS:
        raise UnknownNameError.of("budget", budget, BUDGETS)
    if table is None:
        _list_tables(list(TABLES.values()), BUDGETS[budget], as_json=as_json)
        return
    if table not in TABLES:
        raise UnknownNameError.of("table", table, TABLES)
    from hoz_dist.reproduce.job import jobs_of, seeds_of
    from hoz_dist.reproduce.row import BASELINES

    wanted, spend = TABLES[table], BUDGETS[budget]
    for name in rows:
        if name not in {row.name for row in wanted.rows}:
            raise UnknownNameError.of("row", name, [row.name for row in wanted.rows])
    _refuse_contradictions(rows, docs, estimate=estimate, collect=collect)
    if all(seeds == len(seeds_of(row, spend)) for row in wanted.rows if row.agent not in BASELINES):
        seeds = None
    of_rows = {row.name: jobs_of(wanted, row, spend, None if seeds is None else range(seeds)) for row in wanted.rows}
    command = f"hoz-dist reproduce {table} --budget {budget}" + (f" --seeds {seeds}" if seeds else "")
    chosen = [job for name, jobs_of_row in of_rows.items() if not rows or name in rows for job in jobs_of_row]
    if not collect:
        with _alone(out):
            processes = jobs or len(os.sched_getaffinity(0))
            facts = {"table": table, "budget": budget, "seeds": seeds, "rows": list(rows)}
            finished = work_off(chosen, out, cache, processes, facts, only_estimate=estimate, as_json=as_json)
        if not finished:
            return
    _show(wanted, spend, command, of_rows, out, docs, seeds=seeds, as_json=as_json)


def _refuse_contradictions(rows: Sequence[str], docs: Path | None, *, estimate: bool, collect: bool) -> None:
    """Refuse options of which one would be passed over.

    Raises:
        InvalidValueError: There are such.
    """
    contradictions = (
        (rows and collect, "--row chooses what is trained and --collect trains nothing"),
        (estimate and collect, "--estimate says how long the training takes and --collect trains nothing"),
        (estimate and docs is not None, "--estimate makes no files and --docs says where to put them"),
    )
    for contradict, what in contradictions:
        if contradict:
            message = f"{what}; leave out one of them."
            raise InvalidValueError(message)


def work_off(
    jobs: "Sequence[Job]",
    out: Path,
    cache: Path | None,
    processes: int,
    facts: Mapping[str, Any],
    *,
    only_estimate: bool,
    as_json: bool,
) -> bool:
    """Say how long jobs take, then do them.

    Args:
        jobs: What is to do; finished ones are passed over.
        out: Folder of runs and results.
        cache: The view cache; the default one when None.
        processes: Runs at once.
        facts: What else is noted of this start, as JSON values.
        only_estimate: Do nothing but the measurement.
        as_json: Print the estimate as JSON, when it is all that is wanted.

    Returns:
        Whether the jobs are done.

    Raises:
        HozError: Something failed; what is finished is kept.
        OwnMistakeError: A process failed without a reason.
    """
    from hoz_dist.cli.progress import duration
    from hoz_dist.cli.reproducing.costs import measure_costs, missing_rooms, render, rooms_needed
    from hoz_dist.cli.reproducing.crew import run_tasks, seconds_left
    from hoz_dist.cli.reproducing.sessions import Session
    from hoz_dist.cli.reproducing.task import Place
    from hoz_dist.reproduce.costs import makespan
    from hoz_dist.reproduce.job import tasks_of
    from hoz_dist.sim.view_store import default_cache

    place, began = Place(out, cache or default_cache()), time.monotonic()
    tasks = [task for task in tasks_of(jobs, out) if task.waiting(out)]
    if not tasks:
        if only_estimate:
            echo_json({"seconds": 0.0, "runs": 0}) if as_json else click.echo("Everything is finished.")
        return not only_estimate
    picture_size = tasks[0].jobs[0].test_config.picture_size
    costs = measure_costs(tasks, place.cache, picture_size, min(processes, len(tasks)))
    seconds = costs.render_seconds + makespan(seconds_left(tasks, place, costs), processes)
    if only_estimate and as_json:
        echo_json({"seconds": round(seconds), "runs": len(tasks), "costs": costs.to_json()})
    else:
        learning = sum(task.training is not None for task in tasks)
        click.echo(
            f"Agents left: {len(tasks)}, of which {learning} learn; with {processes} at once it takes about "
            f"{duration(seconds)}.",
            err=not only_estimate,
        )
    if only_estimate:
        return False
    estimate = {
        "runs": len(tasks),
        "jobs": processes,
        "measuring_seconds": round(time.monotonic() - began, 1),
        "estimated_seconds": round(seconds, 1),
        "costs": costs.to_json(),
    }
    with Session(out, {**facts, **estimate}) as session:
        render(missing_rooms(rooms_needed(tasks), place.cache, picture_size), place.cache, picture_size)
        run_tasks(tasks, place, processes, costs)
    click.echo(f"Took {duration(session.seconds)}; {duration(seconds)} were expected.", err=True)
    return True


def _show(
    table: "Table",
    budget: Budget,
    command: str,
    jobs: "Mapping[str, Sequence[Job]]",
    out: Path,
    docs: Path | None,
    *,
    seeds: int | None,
    as_json: bool,
) -> None:
    """Write the table's files, and print it."""
    from hoz_dist.cli.reproducing.results import Results
    from hoz_dist.cli.reproducing.sessions import read_sessions

    results = Results.read(table, budget, command, jobs, out, seeds=seeds)
    sessions = [
        one
        for one in read_sessions(out)
        if (one["table"], one.get("budget"), one.get("seeds")) == (table.name, budget.name, seeds)
    ]
    paths = [path for folder in (out, docs) if folder is not None for path in results.write(folder, sessions)]
    if as_json:
        echo_json(results.to_json())
    else:
        click.echo(results.text())
    click.echo("Written: " + ", ".join(map(str, paths)), err=True)


def _list_tables(tables: "Sequence[Table]", budget: Budget, *, as_json: bool) -> None:
    """Print the tables, one line each."""
    if as_json:
        echo_json({table.name: {"title": table.title, "rows": [row.name for row in table.rows]} for table in tables})
        return
    from hoz_dist.reproduce.job import jobs_of

    width = max(len(table.name) for table in tables)
    for table in tables:
        jobs = [job for row in table.rows for job in jobs_of(table, row, budget)]
        trainings = len({job.training for job in jobs} - {None})  # which rows may share
        size = f"{len(table.rows)} rows, {trainings} trainings of {budget.frames(table.scenes) / 1e6:g}M frames"
        click.echo(f"{table.name:{width}}  {table.title}: {size}")
    click.echo("Tables share runs. How long one takes on this machine says:")
    click.echo(f"  hoz-dist reproduce TABLE --budget {budget.name} --estimate")


@contextmanager
def _alone(out: Path) -> Iterator[None]:
    """Keep a second command out of the folder; the system ends the lock when this process ends, however it does."""
    from filelock import FileLock, Timeout

    out.mkdir(parents=True, exist_ok=True)
    lock = FileLock(out / "reproduce.lock", timeout=0)
    try:
        lock.acquire()
    except Timeout:
        message = f"Another hoz-dist reproduce works in '{out}'; wait for it, or choose another --out."
        raise InvalidValueError(message) from None
    try:
        yield
    finally:
        lock.release()
