"""Where an actor's time goes: a JSON line after every update.

A line has the time, the updates and frames so far, the rooms that are not ready yet, and what each stage has taken so
far, so that the difference of any two lines tells of the time in between.
"""

import time
from pathlib import Path

from hoz_dist.closing import Closing
from hoz_dist.stages import StageClock
from workers.json_lines import JsonLines


class Timings(Closing):
    """Writes what a clock says to a file.

    Args:
        path: The file; lines are appended.
        clock: The clock of the actor's stages.

    Raises:
        InvalidValueError: It cannot be written.
    """

    def __init__(self, path: Path, clock: StageClock) -> None:
        self._clock = clock
        self._lines = JsonLines(path, "timings")
        self._updates = 0

    def update(self, frames: int, rooms_waiting: int) -> None:
        """Note an update.

        Args:
            frames: All that the learner has accepted.
            rooms_waiting: Rooms that are not ready yet.

        Raises:
            InvalidValueError: The file cannot be written any more.
        """
        self._updates += 1
        progress = {"updates": self._updates, "frames": frames, "rooms_waiting": rooms_waiting}
        self._lines.write({"time": round(time.time(), 6)} | progress | self._clock.to_json())

    def close(self) -> None:
        """Close the file."""
        self._lines.close()
