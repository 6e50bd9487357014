"""Progress of long work: a bar on a terminal, plain lines elsewhere; both say the speed and the time left."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, TaskID, TextColumn
from rich.progress import Progress as Bar

_MINUTE_S = 60
_HOUR_S = 3600


def duration(seconds: float) -> str:
    """Write a time span for people, for example ``45 s``, ``3 min 05 s`` or ``2 h 10 min``."""
    whole = max(0, round(seconds))
    if whole < _MINUTE_S:
        return f"{whole} s"
    if whole < _HOUR_S:
        return f"{whole // _MINUTE_S} min {whole % _MINUTE_S:02} s"
    return f"{whole // _HOUR_S} h {whole % _HOUR_S // _MINUTE_S:02} min"


def progress_text(
    done: float, total: float, elapsed: float, unit: str | None, note: str = "", left: float | None = None
) -> str:
    """Say how far some work is.

    Args:
        done: How much is done, in units.
        total: How much there is to do, in units.
        elapsed: Seconds since the start.
        unit: What is counted, for example ``"views"``; None leaves out the count and the speed, for work that ends
            after a certain time.
        note: What else is worth saying.
        left: Seconds that are left; None for an estimate from the speed since the start.

    Returns:
        For example ``50%  1,200/2,400 views  240 views/s  kitchen/3  5 s left``.
    """
    share = min(1.0, done / total) if total > 0 else 1.0
    parts = [f"{share:4.0%}"]
    if unit is not None:
        parts.append(f"{done:,.0f}/{total:,.0f} {unit}")
        if elapsed > 0 and done > 0:
            parts.append(f"{done / elapsed:,.0f} {unit}/s")
    if note:
        parts.append(note)
    if share >= 1.0:
        parts.append(f"took {duration(elapsed)}")
    elif left is not None:
        parts.append(f"{duration(left)} left")
    elif share > 0 and elapsed > 0:
        parts.append(f"{duration(elapsed * (1 - share) / share)} left")
    return "  ".join(parts)


class Progress:
    """Shows the progress of one piece of work on standard error, so that standard output stays the result's.

    Use it as a context manager; entering starts the clock.
    """

    def __init__(
        self,
        title: str,
        total: float,
        unit: str | None,
        *,
        console: Console | None = None,
        every: float = 5.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Prepare to show progress.

        Args:
            title: What is being done, for example ``"Rendering"``.
            total: How much there is to do, in units.
            unit: What is counted; see `progress_text`.
            console: Where to show it; standard error by default.
            every: Least time between two plain lines, seconds.
            clock: The time in seconds.
        """
        self._title = title
        self._total = total
        self._unit = unit
        self._console = console or Console(stderr=True)
        self._every = every
        self._clock = clock
        self._start = clock()
        self._printed = float("-inf")
        self._last = ""
        self._bar: Bar | None = None
        self._task = TaskID(0)

    def __enter__(self) -> Self:
        """Start the clock and, on a terminal, the bar."""
        self._start = self._clock()
        if self._console.is_terminal:
            self._bar = Bar(
                TextColumn("{task.description}"),
                BarColumn(bar_width=24),
                TextColumn("{task.fields[text]}", markup=False),
                console=self._console,
            )
            self._task = self._bar.add_task(self._title, total=self._total, text="")
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the last state in sight."""
        if self._bar is not None:
            self._bar.stop()
        elif self._last:
            self._print()

    def update(self, done: float, note: str = "", *, total: float | None = None, left: float | None = None) -> None:
        """Tell how much is done.

        Args:
            done: How much is done since the start, in units.
            note: What else is worth saying, shown as it is.
            total: How much there is to do, if that is known better by now.
            left: Seconds that are left, if somebody knows better than the speed since the start tells.
        """
        now = self._clock()
        self._total = self._total if total is None else total
        self._last = progress_text(done, self._total, now - self._start, self._unit, note, left)
        if self._bar is not None:
            self._bar.update(self._task, completed=done, total=self._total, text=self._last)
        elif now - self._printed >= self._every:
            self._printed = now
            self._print()

    def say(self, line: str) -> None:
        """Print a line that stays, above the bar on a terminal.

        Args:
            line: The line, shown as it is.
        """
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)

    def _print(self) -> None:
        self.say(f"{self._title}  {self._last}")
        self._last = ""
