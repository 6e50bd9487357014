import errno
import multiprocessing
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli import reproduce_costs
from hoz_dist.cli.reproduce_crew import Worker
from hoz_dist.cli.reproduce_task import Report
from hoz_dist.errors import HozError
from hoz_dist.reproduce.job import jobs_of, tasks_of
from tests.unit.reproduce.making import TABLE, TINY


def fill_the_disk(path: str, send: Callable[[Any], None]) -> None:
    del send
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)


def test_a_full_disk_is_no_mistake_of_ours() -> None:
    worker = Worker(multiprocessing.get_context("spawn"), fill_the_disk, "somewhere")
    assert worker.connection.poll(60)
    (report,) = worker.receive()
    worker.join()
    assert report == Report("failed", note="'somewhere': No space left on device.")


class Ended:
    """A worker that has ended without a word."""

    connection = None

    def __init__(self, status: int) -> None:
        self.exit_status = status

    def receive(self) -> list[Any]:
        return []

    def terminate(self) -> None:
        pass

    def join(self) -> None:
        pass


@pytest.mark.parametrize(("status", "reason"), [(-9, "use fewer --jobs"), (1, "a mistake of ours")])
def test_a_measurement_that_was_killed_is_told_from_one_that_failed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, status: int, reason: str
) -> None:
    monkeypatch.setattr(reproduce_costs, "Worker", lambda *_: Ended(status))
    monkeypatch.setattr(reproduce_costs, "wait", lambda *_: [])
    (task,) = tasks_of(jobs_of(TABLE, TABLE.rows[1], TINY), tmp_path)
    with pytest.raises(HozError, match=reason):
        reproduce_costs._speeds({"object": task}, tmp_path, 1)
