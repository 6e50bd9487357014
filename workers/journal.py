"""An actor's journal: one line for each push that the learner acknowledged, for audits.

What the learner recorded must hold every line whose push a checkpoint covers, exactly once.
"""

import json
import time
from contextlib import suppress
from pathlib import Path

from hoz_dist.closing import Closing
from hoz_dist.errors import InvalidValueError
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, Push, RoomGraphPush


class Journal(Closing):
    """Appends JSON lines to a file, each flushed at once, so that a killed actor loses none.

    Args:
        path: The file; made when it is not there.

    Raises:
        InvalidValueError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file = path.open("a", encoding="utf-8")
        except OSError as error:
            raise self._cannot_write(error) from error

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
        try:
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()
        except OSError as error:
            raise self._cannot_write(error) from error

    def close(self) -> None:
        """Close the file."""
        with suppress(OSError):  # said already, when the line was written
            self._file.close()

    def _cannot_write(self, error: OSError) -> InvalidValueError:
        message = f"Cannot write the journal '{self._path}' ({error.strerror}); choose another file with --journal."
        return InvalidValueError(message)


def _content(push: Push) -> dict[str, object]:
    """Return what a push adds to the run."""
    match push:
        case GradientPush():
            return {"computed_on": [push.epoch, push.version], "frames": push.frames}
        case EpisodesPush():
            return {"episodes": len(push.episodes)}
        case RoomGraphPush():
            return {"room": str(push.room)}
        case _:  # pragma: no cover - every kind that is pushed stands above
            raise TypeError(push)
