"""Reading what actors write with ``--timings``: totals after each update, and between any two moments."""

import json
from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hoz_dist.errors import HozError

Totals = dict[str, float]
"""Numbers that grow: ``updates``, ``frames``, ``wall``, ``cpu``, and of each stage ``act.count``, ``act.wall``,
``act.cpu``."""


def totals_of(values: Mapping[str, Any]) -> Totals:
    """Return the totals of a line of a file, or of what a learner tells of its stages."""
    numbers = {name: float(values[name]) for name in ("updates", "frames") if name in values}
    numbers |= {"wall": values["wall_seconds"], "cpu": values["cpu_seconds"]}
    for stage, total in values["stages"].items():
        numbers[f"{stage}.count"] = float(total["count"])
        numbers[f"{stage}.wall"] = total["wall_seconds"]
        numbers[f"{stage}.cpu"] = total["cpu_seconds"]
    return numbers


def between(first: Totals, last: Totals) -> Totals:
    """Return what was added between two moments; what is new began at 0."""
    return {name: value - first.get(name, 0.0) for name, value in last.items()}


class TimingsFile:
    """A file of timings that grows.

    Args:
        path: The file; it may not be there yet.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._read = 0
        self._times: list[float] = []
        self._totals: list[Totals] = []
        self._rooms_waiting = 0

    @property
    def is_ready(self) -> bool:
        """Whether an update was made in all rooms."""
        self._read_on()
        return bool(self._totals) and self._rooms_waiting == 0

    def updates_since(self, time: float) -> int:
        """Return the number of updates that ended after a time, seconds since the epoch."""
        self._read_on()
        return len(self._times) - bisect_right(self._times, time)

    def at(self, time: float) -> Totals:
        """Return the totals at a time, seconds since the epoch, as if they grew evenly between two updates.

        Raises:
            HozError: No update ended before it, or none after it.
        """
        after = bisect_right(self._times, time)
        if after == 0 or after == len(self._times):
            message = "An actor made no update for too long; measure for longer with --seconds."
            raise HozError(message)
        first, last = self._totals[after - 1], self._totals[after]
        share = (time - self._times[after - 1]) / (self._times[after] - self._times[after - 1])
        return {name: first.get(name, 0.0) + share * grown for name, grown in between(first, last).items()}

    def _read_on(self) -> None:
        """Read the lines that are new; one that is not whole yet is left for later."""
        if not self._path.exists():
            return
        with self._path.open("rb") as file:
            file.seek(self._read)
            new = file.read()
        whole = new[: new.rfind(b"\n") + 1]
        self._read += len(whole)
        for line in whole.splitlines():
            values = json.loads(line)
            self._times.append(values["time"])
            self._totals.append(totals_of(values))
            self._rooms_waiting = values["rooms_waiting"]
