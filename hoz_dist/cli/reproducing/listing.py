"""What `hoz-dist reproduce` lists: the tables, and the folders of finished runs."""

from collections.abc import Sequence
from pathlib import Path

import click

from hoz_dist.cli.options import echo_json
from hoz_dist.errors import InvalidValueError
from hoz_dist.reproduce.budget import Budget
from hoz_dist.reproduce.job import Job, jobs_of
from hoz_dist.reproduce.row import Table


def list_tables(tables: Sequence[Table], budget: Budget, *, as_json: bool) -> None:
    """Print the tables, one line each."""

    def trainings(table: Table) -> int:
        jobs = [job for row in table.rows for job in jobs_of(table, row, budget)]
        return len({job.training for job in jobs} - {None})  # which rows may share

    if as_json:
        echo_json(
            {
                table.name: {
                    "title": table.title,
                    "rows": [row.name for row in table.rows],
                    "budget": budget.name,
                    "trainings": trainings(table),
                    "frames": budget.frames(table.scenes),
                }
                for table in tables
            }
        )
        return
    width = max(len(table.name) for table in tables)
    for table in tables:
        frames = budget.frames(table.scenes) / 1e6
        size = f"{len(table.rows)} rows, {trainings(table)} trainings of {frames:g}M frames"
        click.echo(f"{table.name:{width}}  {table.title}: {size}")
    click.echo("Tables share runs. How long one takes on this machine says:")
    click.echo(f"  hoz-dist reproduce TABLE --budget {budget.name} --estimate")


def list_runs(jobs: Sequence[Job], out: Path, *, as_json: bool) -> None:
    """Print the folders of the runs that are trained and tested, in the order of the rows.

    Raises:
        InvalidValueError: There are none.
    """
    tested = [job.training.folder(out) for job in jobs if job.training is not None and job.result(out).exists()]
    folders = [str(folder) for folder in dict.fromkeys(tested) if folder.is_dir()]
    if not folders:
        lack = "results of these rows, but not their runs" if tested else "no finished run of these rows"
        where = "in another --out" if tested else "first"  # with their results there, nothing is trained
        message = f"'{out}' has {lack}; train them {where}, by the same command without --runs."
        raise InvalidValueError(message)
    if as_json:
        echo_json(folders)
    else:
        click.echo("\n".join(folders))
