"""Processes that help a campaign, such as the prober, and waiting for what a campaign needs."""

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from hoz_dist.wire.transport.environment import child_environment

STOP_S: Final = 120.0
"""How long a helper may take to end what is under way, seconds."""
_ROOT: Final = Path(__file__).parents[2]


@contextmanager
def helper(module: str, *words: str, log: Path, within: tuple[str, ...] = ()) -> Iterator["subprocess.Popen[bytes]"]:
    """Run a module of this package in a process of its own; it is killed at the end if it still runs.

    Raises:
        RuntimeError: It ended by itself with an error.
    """
    command = [*within, sys.executable, "-m", f"tests.campaigns.{module}", *words]
    with log.open("ab") as output:
        process = subprocess.Popen(
            command, cwd=_ROOT, env=child_environment(), stdout=output, stderr=subprocess.STDOUT, process_group=0
        )
    try:
        yield process
        if process.poll():
            message = f"{module} ended with status {process.returncode}: {log.read_text()[-1000:]}"
            raise RuntimeError(message)
    finally:
        process.kill()
        process.wait(STOP_S)


def finish(*processes: "subprocess.Popen[bytes]") -> None:
    """Tell helpers to end, and wait until they have."""
    for process in processes:
        process.send_signal(signal.SIGTERM)
    for process in processes:
        process.wait(STOP_S)


def pause(seconds: float) -> None:
    """Let time pass: a campaign is made of times."""
    threading.Event().wait(max(seconds, 0.0))
