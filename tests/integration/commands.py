"""Runs real `hoz-dist` commands as processes, and waits for what they bring about."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import Self

from hoz_dist.wire.transport.environment import child_environment

DEADLINE_S = 60.0
SMALL_ROOMS = ("bathroom/7", "bathroom/10")
"""Training rooms with few views."""


class HozDist:
    """A running `hoz-dist` command. Use it in a ``with`` statement; it is killed at the end if it still runs.

    Args:
        words: The words after `hoz-dist`.
        log: File for all that it prints.
    """

    def __init__(self, *words: str, log: Path) -> None:
        self.log = log
        with log.open("ab") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "hoz_dist.cli.main", *words],
                env=child_environment(),
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None:
            self.stop(signal.SIGKILL)

    @property
    def said(self) -> str:
        return self.log.read_text(errors="replace")

    @property
    def runs(self) -> bool:
        return self.process.poll() is None

    def stop(self, number: signal.Signals) -> int:
        self.process.send_signal(number)
        return self.wait()

    def wait(self) -> int:
        return self.process.wait(DEADLINE_S)


def hoz_dist(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a `hoz-dist` command to its end."""
    command = [sys.executable, "-m", "hoz_dist.cli.main", *words]
    return subprocess.run(
        command, env=os.environ | environment, capture_output=True, text=True, timeout=DEADLINE_S, check=False
    )


def children_of(parent: int) -> list[int]:
    """Return the processes that a `hoz-dist train` of this id has started and that run, also after its own end."""
    # It tells each of them its own process id.
    mark = f"hoz_dist.cli.child\0{parent}:".encode()
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and mark in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except OSError:
            continue  # it ended meanwhile
    return found
