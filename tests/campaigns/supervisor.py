"""Keeps processes running, as systemd or Kubernetes would: what ends is started again.

Every process starts in a process group of its own and dies with this one, however this one dies.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from hoz_dist.closing import Closing
from hoz_dist.wire.transport.environment import child_environment

POLL_S: Final = 0.02
STOP_S: Final = 30.0
"""How long a process may take to stop cleanly, seconds."""


class Program(NamedTuple):
    """A `hoz-dist` command that is kept running."""

    name: str
    """What it is called here; its log is `NAME.log`."""
    words: tuple[str, ...]
    """The words after `hoz-dist`."""
    within: tuple[str, ...] = ()
    """A command that it is run by and that becomes it, for example ``ip netns exec far``."""


@dataclass
class Life:
    """One process of a program, from its start to its end."""

    program: Program
    process: subprocess.Popen[bytes]
    began: float
    """Seconds since 1970, as all times here: they are compared between processes."""
    ended: float | None = None
    struck: bool = False
    """Whether it was killed, or told to stop, by whoever holds the supervisor."""
    paused_until: float | None = None

    @property
    def code(self) -> int | None:
        """Exit status, or the negative number of the signal; None while it runs."""
        return self.process.returncode


@dataclass
class _Slot:
    program: Program
    life: Life
    wanted: bool = True
    """Whether it is to be started again."""


class Supervisor(Closing):
    """Starts programs and starts again what ends. Use it in a ``with`` statement; all are killed at its end.

    Args:
        folder: Where the logs go.
        restart_s: Time between the end of a process and the start of the next, seconds.

    Attributes:
        lives: All processes so far, in the order of their start.
    """

    def __init__(self, folder: Path, restart_s: float = 0.5) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.lives: list[Life] = []
        self._folder, self._restart_s = folder, restart_s
        self._slots: dict[str, _Slot] = {}
        self._lock = threading.RLock()
        self._closed = threading.Event()
        # Linux ties a child to the thread that made it, so one thread makes them all and outlives them.
        self._asked: list[Program] = []
        self._started = threading.Condition(self._lock)
        self._thread = threading.Thread(target=self._watch, name="supervisor")
        self._thread.start()

    def start(self, program: Program) -> None:
        """Start a program, and again whenever it ends."""
        with self._started:
            self._asked.append(program)
            self._started.wait_for(lambda: program not in self._asked, STOP_S)

    def stop(self, *names: str, number: signal.Signals = signal.SIGTERM) -> dict[str, int]:
        """Send a signal to programs, for good; returns their exit statuses."""
        with self._lock:
            slots = [self._slots[name] for name in names]
            for slot in slots:
                slot.wanted, slot.life.struck = False, True
                slot.life.process.send_signal(number)
                self._resume(slot.life)
        return {slot.program.name: slot.life.process.wait(STOP_S) for slot in slots}

    def kill(self, name: str) -> float | None:
        """Kill the process of a program, which will be started again.

        Returns:
            When; None when it does not run just now.
        """
        with self._lock:
            life = self._slots[name].life
            if life.process.poll() is not None:
                return None
            life.struck = True
            now = time.time()
            life.process.kill()
            return now

    def pause(self, name: str, seconds: float) -> float | None:
        """Stop the process of a program for so long.

        Returns:
            When; None when it does not run just now, or is stopped already.
        """
        with self._lock:
            life = self._slots[name].life
            if life.process.poll() is not None or life.paused_until is not None:
                return None
            now = time.time()
            life.process.send_signal(signal.SIGSTOP)
            life.paused_until = now + seconds
            return now

    def running(self) -> Mapping[str, Life]:
        """Return the processes that run now, paused or not, by name of the program."""
        with self._lock:
            return {name: slot.life for name, slot in self._slots.items() if slot.life.process.poll() is None}

    def settled(self) -> bool:
        """Tell whether all programs run and none is paused."""
        with self._lock:
            return all(
                slot.life.process.poll() is None and slot.life.paused_until is None for slot in self._slots.values()
            )

    def said(self, name: str) -> str:
        """Return all that the processes of a program printed."""
        return (self._folder / f"{name}.log").read_text(errors="replace")

    def close(self) -> None:
        """Kill everything."""
        self._closed.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._closed.wait(POLL_S):
            with self._started:
                for program in self._asked:
                    self._slots[program.name] = _Slot(program, self._spawn(program))
                self._asked.clear()
                self._started.notify_all()
                for slot in self._slots.values():
                    self._look_after(slot, time.time())
        for slot in self._slots.values():
            with suppress(ProcessLookupError):
                slot.life.process.kill()
            slot.life.process.wait(STOP_S)

    def _look_after(self, slot: _Slot, now: float) -> None:
        life = slot.life
        if life.process.poll() is not None:
            life.ended = now if life.ended is None else life.ended
            if slot.wanted and now - life.ended >= self._restart_s:
                slot.life = self._spawn(slot.program)
        elif life.paused_until is not None and now >= life.paused_until:
            self._resume(life)

    @staticmethod
    def _resume(life: Life) -> None:
        life.process.send_signal(signal.SIGCONT)
        life.paused_until = None

    def _spawn(self, program: Program) -> Life:
        command = [
            *program.within,
            *(sys.executable, "-m", "hoz_dist.cli.child", str(os.getpid()), *program.words),
        ]
        with (self._folder / f"{program.name}.log").open("ab") as output:
            process = subprocess.Popen(
                command, env=child_environment(), stdout=output, stderr=subprocess.STDOUT, process_group=0
            )
        life = Life(program, process, time.time())
        self.lives.append(life)
        return life
