"""Child processes of `hoz-dist train`: started, watched, restarted when killed, stopped together."""

import logging
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from hoz_dist.errors import HozError
from hoz_dist.wire.transport.environment import child_environment

_log = logging.getLogger(__name__)
STOP_S: Final = 20.0
"""How long a process may take to stop cleanly before it is killed, seconds."""
MOST_RESTARTS: Final = 5
"""Restarts of one process; one that dies again and again has another reason than a passing one."""


class Child:
    """One `hoz-dist` process."""

    def __init__(
        self, name: str, arguments: Sequence[str], log: Path, orphaned: signal.Signals = signal.SIGTERM
    ) -> None:
        """Start the process.

        Args:
            name: For messages, such as ``actor-0``.
            arguments: The words after `hoz-dist`.
            log: File that its output is appended to.
            orphaned: Signal that it gets when this process dies; one that may be paused hears none but SIGKILL.
        """
        self.name = name
        self.log = log
        self._arguments = tuple(arguments)
        self._orphaned = orphaned
        self._restarts = 0
        self._process = self._start()

    @property
    def status(self) -> int | None:
        """Exit status, negative for a signal; None while it runs."""
        return self._process.poll()

    def keep_running(self) -> None:
        """Start the process again if something killed or stopped it.

        Raises:
            HozError: It failed by itself, or was killed too often.
        """
        status = self.status
        if status is None:
            return
        if status > 0 or self._restarts >= MOST_RESTARTS:
            message = f"The {self.name} failed: {self.last_words()}"
            raise HozError(message)
        self._restarts += 1
        _log.warning("%s was stopped (exit status %d); starting it again", self.name, status)
        self._process = self._start()

    def last_words(self) -> str:
        """Return the last line that the process wrote."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        last = lines[-1].removeprefix("hoz-dist: ") if lines else f"exit status {self.status}, see {self.log}"
        return last if last.endswith(".") else f"{last} (see {self.log})."

    def pause(self) -> None:
        """Let the process stand still; see ``orphaned``."""
        self._process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Let the process go on after `pause`."""
        self._process.send_signal(signal.SIGCONT)

    def terminate(self) -> None:
        """Ask the process to stop."""
        if self.status is None:
            self._process.send_signal(signal.SIGTERM)
            self.resume()  # one that stands still hears nothing

    def wait(self) -> None:
        """Wait until the process has stopped; kill it if that takes too long."""
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            _log.warning("%s did not stop within %g s and is killed", self.name, STOP_S)
            self._process.kill()
            self._process.wait()

    def _start(self) -> subprocess.Popen[bytes]:
        parent = f"{os.getpid()}:{int(self._orphaned)}"
        with self.log.open("ab") as output:
            return subprocess.Popen(  # noqa: S603 - our own command
                [sys.executable, "-m", "hoz_dist.cli.child", parent, *self._arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=child_environment(),
                # Ctrl-C reaches this process alone, which then stops its children in order.
                start_new_session=True,
            )


class Children:
    """Processes that stop together, the last one started first; use it in a ``with`` statement.

    Args:
        orphaned: Signal that they get when this process dies; those that may be paused hear none but SIGKILL.
    """

    def __init__(self, orphaned: signal.Signals = signal.SIGTERM) -> None:
        self._orphaned = orphaned
        self._children: list[Child] = []

    def start(self, name: str, arguments: Sequence[str], log: Path) -> Child:
        """Start a process; see `Child`."""
        child = Child(name, arguments, log, self._orphaned)
        self._children.append(child)
        return child

    def __iter__(self) -> Iterator[Child]:
        return iter(self._children)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for child in reversed(self._children):
            child.terminate()
            child.wait()
