"""An actor's journal: one line for each push that the learner acknowledged, for audits.

What the learner recorded must hold every line whose push a checkpoint covers, exactly once.
"""

import time
from pathlib import Path

from hoz_dist.closing import Closing
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, Push, RoomGraphPush
from hoz_dist.wire.protocol.trajectories import TrajectoryPush
from workers.json_lines import JsonLines


class Journal(Closing):
    """Notes pushes in a file.

    Args:
        path: The file; lines are appended.

    Raises:
        InvalidValueError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._lines = JsonLines(path, "journal")

    def write(self, push: Push, answer: Accepted, tries: int) -> None:
        """Note a push that was accepted.

        Args:
            push: The push.
            answer: What the learner said; its version is the newest one after the push.
            tries: How often it was sent.

        Raises:
            InvalidValueError: The file cannot be written any more.
        """
        line = {
            "time": round(time.time(), 3),
            "kind": push.KIND,
            "actor": push.actor,
            "incarnation": push.incarnation,
            "sequence": push.sequence,
            "epoch": answer.epoch,
            "version": answer.version,
            **_content(push),
            "tries": tries,
        }
        self._lines.write(line)

    def close(self) -> None:
        """Close the file."""
        self._lines.close()


def _content(push: Push) -> dict[str, object]:
    """Return what a push adds to the run."""
    match push:
        case GradientPush() | TrajectoryPush():
            return {"computed_on": [push.epoch, push.version], "frames": push.frames}
        case EpisodesPush():
            return {"episodes": len(push.episodes)}
        case RoomGraphPush():
            return {"room": str(push.room)}
        case _:  # pragma: no cover - every kind that is pushed stands above
            raise TypeError(push)
