"""How much memory processes hold for themselves."""

import json
import re
import threading
import time
from collections import defaultdict
from pathlib import Path
from typing import Final, NamedTuple

from hoz_dist.closing import Closing
from tests.campaigns.supervisor import Supervisor

EVERY_S: Final = 0.25
_LINE: Final = re.compile(r"^(?:RssAnon|RssShmem):\s+(\d+) kB$", re.MULTILINE)


class Sample(NamedTuple):
    """Memory of one process at a time."""

    time: float
    pid: int
    kilobytes: int


def held_by(pid: int) -> int | None:
    """Return the kilobytes of memory that a process does not share with files; None when it is gone.

    View stores are mapped files, which the kernel takes back when it needs the memory, so they do not count.
    """
    try:
        parts = _LINE.findall(Path(f"/proc/{pid}/status").read_text(encoding="utf-8"))
    except OSError:
        return None
    return sum(map(int, parts)) if parts else None


class MemoryWatch(Closing):
    """Measures all processes of a supervisor, again and again. Use it in a ``with`` statement.

    Attributes:
        samples: By name of the program.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self.samples: dict[str, list[Sample]] = defaultdict(list)
        self._supervisor = supervisor
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="memory")
        self._thread.start()

    def save(self, path: Path) -> None:
        """Write all samples as JSON, for whoever looks into what a campaign found."""
        path.write_text(json.dumps(self.samples), encoding="utf-8")

    def close(self) -> None:
        """Measure no more."""
        self._closed.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._closed.wait(EVERY_S):
            for name, life in self._supervisor.running().items():
                kilobytes = held_by(life.process.pid)
                if kilobytes is not None:
                    self.samples[name].append(Sample(time.time(), life.process.pid, kilobytes))


def highest(samples: list[Sample], begin: float, end: float) -> float:
    """Return the most memory at one time, megabytes; 0 when nothing was measured."""
    return max((sample.kilobytes for sample in samples if begin <= sample.time < end), default=0) / 1024
