import errno
import multiprocessing
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.reproducing import costs as reproduce_costs
from hoz_dist.cli.reproducing.worker import Failure, Worker
from hoz_dist.errors import HozError, OwnMistakeError
from hoz_dist.reproduce.costs import Speed
from hoz_dist.reproduce.job import jobs_of, tasks_of
from tests.unit.cli.reproducing.workers import Worked
from tests.unit.reproduce.making import TABLE, TINY


def fill_the_disk(path: str, send: Callable[[Any], None]) -> None:
    del send
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)


def test_a_full_disk_is_no_mistake_of_ours() -> None:
    worker = Worker(multiprocessing.get_context("spawn"), fill_the_disk, "somewhere")
    assert worker.connection.poll(60)
    received = worker.receive()
    worker.join()
    assert received == [Failure("'somewhere': No space left on device.")]


@pytest.mark.parametrize(
    ("status", "kind", "reason"), [(-9, HozError, "use fewer --jobs"), (1, OwnMistakeError, "a mistake of ours")]
)
def test_a_measurement_that_was_killed_is_told_from_one_that_failed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, status: int, kind: type[Exception], reason: str
) -> None:
    monkeypatch.setattr(reproduce_costs, "Worker", lambda *_: Worked(status))
    monkeypatch.setattr(reproduce_costs, "wait", lambda *_: [])
    (task,) = tasks_of(jobs_of(TABLE, TABLE.rows[1], TINY), tmp_path)
    with pytest.raises(kind, match=reason):
        reproduce_costs._speeds({"object": task}, tmp_path, 1)


def test_a_measurement_that_fails_says_why(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(reproduce_costs, "Worker", lambda *_: Worked(1, [Failure("The disk is full.")]))
    monkeypatch.setattr(reproduce_costs, "wait", lambda *_: [])
    (task,) = tasks_of(jobs_of(TABLE, TABLE.rows[1], TINY), tmp_path)
    with pytest.raises(HozError, match=r"The disk is full\."):
        reproduce_costs._speeds({"object": task}, tmp_path, 1)


def test_measuring_waits_only_for_processes_that_owe_something(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    quick, slow = Worked(0, [Speed(1.0, 0.1)]), Worked(0, [], [Speed(3.0, 0.3)])
    workers, waited = iter([quick, slow]), list[list[object]]()
    monkeypatch.setattr(reproduce_costs, "Worker", lambda *_: next(workers))
    monkeypatch.setattr(reproduce_costs, "wait", lambda connections, _: waited.append(list(connections)))
    (task,) = tasks_of(jobs_of(TABLE, TABLE.rows[1], TINY), tmp_path)
    assert reproduce_costs._speeds({"object": task}, tmp_path, 2) == {"object": Speed(2.0, 0.2)}
    assert waited == [[quick.connection, slow.connection], [slow.connection]]
