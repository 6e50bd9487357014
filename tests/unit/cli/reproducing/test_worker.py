import multiprocessing
import sys
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

from hoz_dist.cli.reproducing.worker import Worker

START_S = 60.0
"""How long two processes may take to start, seconds."""
END_S = 20.0
"""How long a process may take to end, seconds."""
WORK_S = 3 * END_S
"""How long a worker of a killed command works if nothing stops it, seconds: none is left for good."""


def hold(lock: str, send: Callable[[Any], None]) -> None:
    """Work for long; the lock is free when the process has ended, however it did."""
    with FileLock(lock):
        send("at work")
        threading.Event().wait(WORK_S)


def command(lock: str, sending: Connection) -> None:
    """A command with one worker."""
    worker = Worker(multiprocessing.get_context("spawn"), hold, lock)
    if worker.connection.poll(START_S):
        sending.send(worker.receive())
    threading.Event().wait(WORK_S)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a killed parent leaves its children running")
def test_a_worker_ends_with_a_command_that_is_killed(tmp_path: Path) -> None:
    lock, context = tmp_path / "lock", multiprocessing.get_context("spawn")
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=command, args=(str(lock), sending))
    process.start()
    try:
        assert receiving.poll(START_S)
        assert receiving.recv() == ["at work"]
        assert process.is_alive()
    finally:
        process.kill()
        process.join()
    # A worker that went on would train on in a folder in which the command, started again, trains too.
    with FileLock(lock, timeout=END_S):
        pass
