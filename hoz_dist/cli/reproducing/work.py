"""What `hoz-dist reproduce` has to do: how long it takes, then the work itself, one command at a time in a folder."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
from filelock import FileLock, Timeout

from hoz_dist.cli.options import echo_json
from hoz_dist.cli.progress import duration
from hoz_dist.cli.rendering import Encoding, render_missing
from hoz_dist.cli.reproducing.costs import measure_costs
from hoz_dist.cli.reproducing.crew import run_tasks, seconds_left
from hoz_dist.cli.reproducing.outcomes import refuse_lost_runs
from hoz_dist.cli.reproducing.sessions import Session
from hoz_dist.cli.reproducing.task import Place
from hoz_dist.errors import InvalidValueError
from hoz_dist.reproduce.costs import makespan
from hoz_dist.reproduce.job import Job, rooms_needed, tasks_of
from hoz_dist.sim.view_store import default_cache


@contextmanager
def alone(out: Path) -> Iterator[None]:
    """Keep a second command out of the folder; the system ends the lock when this process ends, however it does."""
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


def work_off(
    jobs: Sequence[Job],
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
    place, began = Place(out, cache or default_cache()), time.monotonic()
    tasks = [task for task in tasks_of(jobs, out) if task.waiting(out)]
    refuse_lost_runs(tasks, out)
    if not tasks:
        if only_estimate:
            if as_json:
                echo_json({"seconds": 0.0, "runs": 0})
            else:
                click.echo("Everything is finished.")
        return not only_estimate
    picture_size = tasks[0].jobs[0].test_config.picture_size
    costs = measure_costs(tasks, place.cache, picture_size, processes)
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
        render_missing(rooms_needed(tasks), place.cache, picture_size, processes, Encoding())
        run_tasks(tasks, place, processes, costs)
    click.echo(f"Took {duration(session.seconds)}; {duration(seconds)} were expected.", err=True)
    return True
