"""The record of applied updates, and repeating a run in a recorded order.

Two runs are identical only when the same gradients are applied in the same order with the same learning rates, which
under asynchronous training depends on timing. So the learner writes down each applied update, and with ``--replay``
applies gradients, or learns from rollouts, in the order of such a record.

Each epoch has a file of its own, ``updates/epoch-0002.jsonl``, so that a learner that was deposed and does not know it
yet cannot write into the record of the next one. Its first line names the epoch and the version that it began from;
line n after it made version ``from_version`` + n. What an epoch applied beyond the version that a later one began from
was lost with its learner, and does not count.
"""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal, NamedTuple

from hoz_dist.errors import DamagedFileError, NotFoundError

UPDATES_FOLDER: Final = "updates"
"""Where a run folder keeps the records."""


class EpochStart(NamedTuple):
    """The first line of an epoch's record."""

    epoch: int
    from_version: int

    @property
    def file_name(self) -> str:
        """Name of the record."""
        return f"epoch-{self.epoch:04d}.jsonl"

    def to_line(self) -> str:
        """Return it as a line of JSON."""
        return json.dumps(self._asdict()) + "\n"

    @classmethod
    def from_line(cls, line: str) -> "EpochStart":
        """Read a line that `to_line` returned.

        Raises:
            ValueError: It is something else.
        """
        match json.loads(line):
            case {"epoch": int(epoch), "from_version": int(version)} if version >= 0:
                return cls(epoch, version)
        message = "not the beginning of a record"
        raise ValueError(message)


class UpdateRecord(NamedTuple):
    """One applied update."""

    actor: str
    incarnation: int
    sequence: int
    version: int
    """The version that the gradient was computed on."""
    lag: int
    learning_rate: float

    def to_line(self) -> str:
        """Return the record as a line of JSON; the learning rate survives exactly."""
        return json.dumps(self._asdict()) + "\n"

    @classmethod
    def from_line(cls, line: str) -> "UpdateRecord":
        """Read a line that `to_line` returned.

        Raises:
            ValueError: It is something else.
        """
        match json.loads(line):
            case {
                "actor": str(actor),
                "incarnation": int(incarnation),
                "sequence": int(sequence),
                "version": int(version),
                "lag": int(lag),
                "learning_rate": float(learning_rate),
            }:
                return cls(actor, incarnation, sequence, version, lag, learning_rate)
        message = "not a record of an update"
        raise ValueError(message)


def read_updates(path: Path) -> list[UpdateRecord]:
    """Read the recorded updates of a run; record v (from 0) made version v + 1 of the parameters.

    Args:
        path: A run folder, its folder of updates, or the record of an epoch that began the run.

    Raises:
        NotFoundError: There is no record.
        DamagedFileError: It holds something else, or updates are missing.
    """
    folder = path / UPDATES_FOLDER if (path / UPDATES_FOLDER).is_dir() else path
    files = sorted(folder.glob("epoch-*.jsonl")) if folder.is_dir() else [folder]
    if not files:
        message = f"There are no recorded updates in '{path}'; give the updates folder of a run."
        raise NotFoundError(message)
    records: list[UpdateRecord] = []
    for start, updates in sorted((_read_epoch(file) for file in files), key=lambda epoch: epoch[0]):
        if start.from_version > len(records):
            message = (
                f"'{path}' lacks the updates between versions {len(records)} and {start.from_version}; "
                "give the whole updates folder of a run, or repeat another one."
            )
            raise DamagedFileError(message)
        records[start.from_version :] = updates
    return records


def _read_epoch(path: Path) -> tuple[EpochStart, list[UpdateRecord]]:
    """Read the record of one epoch; a last line that a killed learner did not finish is left out.

    Raises:
        NotFoundError: There is no such file.
        DamagedFileError: It holds something else.
    """
    start: EpochStart | None = None
    records: list[UpdateRecord] = []
    try:
        with path.open(encoding="utf-8") as file:
            for line in file:
                if start is None:
                    start = EpochStart.from_line(line)
                elif line.endswith("\n"):
                    records.append(UpdateRecord.from_line(line))
        if start is None:
            message = "it is empty"
            raise ValueError(message)  # noqa: TRY301 - one handler for all kinds of damage
    except OSError as error:
        message = f"Cannot read the recorded updates '{path}' ({error.strerror}); give the updates folder of a run."
        raise NotFoundError(message) from error
    except ValueError as error:
        line_number = 1 if start is None else len(records) + 2
        message = f"Line {line_number} of '{path}' is not a recorded update; give the updates folder of a run."
        raise DamagedFileError(message) from error
    return start, records


class Schedule:
    """The recorded order in which gradients are to be applied.

    Actors are matched by name and sequence number; their incarnations differ from run to run.

    Args:
        records: All updates of the recorded run.
        applied: Number of them that were repeated before, by an earlier learner.

    Attributes:
        actors: Names of the recorded actors, sorted.
    """

    def __init__(self, records: Sequence[UpdateRecord], applied: int = 0) -> None:
        self.actors = sorted({record.actor for record in records})
        self._records = records
        self._next = min(applied, len(records))
        self._left = Counter((record.actor, record.sequence) for record in records[self._next :])
        self.diverged = 0
        """Gradients that were computed on another version than the recorded one: the run is not the recorded one."""

    @property
    def applied(self) -> int:
        """Number of updates repeated so far, by all learners of the run."""
        return self._next

    @property
    def total(self) -> int:
        """Number of recorded updates."""
        return len(self._records)

    @property
    def done(self) -> bool:
        """Whether every recorded update was repeated."""
        return self._next == len(self._records)

    def status(self) -> dict[str, int]:
        """Return how far it is, as JSON values."""
        return {"applied": self.applied, "total": self.total, "diverged": self.diverged}

    def turn(self, actor: str, sequence: int) -> Literal["now", "later", "never"]:
        """Tell when a gradient is to be applied: never, when the recorded run did not apply it."""
        if self._left[actor, sequence] == 0:
            return "never"
        record = self._records[self._next]
        return "now" if (record.actor, record.sequence) == (actor, sequence) else "later"

    def take(self, version: int) -> float:
        """Go on to the next update and return the learning rate of the one that is applied now.

        Args:
            version: The version that the gradient was computed on.
        """
        record = self._records[self._next]
        self._next += 1
        self._left[record.actor, record.sequence] -= 1
        self.diverged += version != record.version
        return record.learning_rate
