"""Where the time of a process goes, by the stages of its work.

    clock = StageClock()
    with clock("push"):
        ...  # encode it
        with clock("answer"):
            ...  # wait; does not count for "push"

Costs a few microseconds a stage, so stages are counted in updates, not in steps.
"""

import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple


class StageTotal(NamedTuple):
    """What a stage has taken so far, less the stages within it."""

    passages: int = 0
    """How often it was gone through."""
    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0
    """Time in which its thread really ran; the rest it waited, or its core was another one's."""


class StageClock:
    """Adds up the time of each stage; any thread may use it, and each counts its own stages."""

    def __init__(self) -> None:
        self._began = time.perf_counter()
        self._lock = threading.Lock()
        self._totals: defaultdict[str, StageTotal] = defaultdict(StageTotal)
        self._thread = _Thread()

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Count the time in the ``with`` statement for a stage."""
        within = self._thread.within
        inner = _Inner()
        within.append(inner)
        began, ran = time.perf_counter(), time.thread_time()
        try:
            yield
        finally:
            wall, cpu = time.perf_counter() - began, time.thread_time() - ran
            within.pop()
            if within:
                within[-1].wall += wall
                within[-1].cpu += cpu
            self._add(stage, wall - inner.wall, cpu - inner.cpu)

    def totals(self) -> dict[str, StageTotal]:
        """Return what each stage has taken so far."""
        with self._lock:
            return dict(self._totals)

    def to_json(self) -> dict[str, Any]:
        """Return the totals, and the time of the whole process, as JSON values."""
        return {
            "wall_seconds": round(time.perf_counter() - self._began, 6),
            "cpu_seconds": round(time.process_time(), 6),
            "stages": {
                name: {
                    "count": total.passages,
                    "wall_seconds": round(total.wall_seconds, 6),
                    "cpu_seconds": round(total.cpu_seconds, 6),
                }
                for name, total in self.totals().items()
            },
        }

    def _add(self, stage: str, wall: float, cpu: float) -> None:
        with self._lock:
            total = self._totals[stage]
            self._totals[stage] = StageTotal(total.passages + 1, total.wall_seconds + wall, total.cpu_seconds + cpu)


@dataclass(slots=True)
class _Inner:
    """What the stages within one have taken, seconds."""

    wall: float = 0.0
    cpu: float = 0.0


class _Thread(threading.local):
    """The stages that a thread is in."""

    def __init__(self) -> None:
        self.within: list[_Inner] = []
