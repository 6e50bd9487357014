"""What the learner writes down as it goes: TensorBoard scalars and the record of updates."""

import contextlib
import os
import threading
from pathlib import Path
from typing import Any, Final

from torch.utils.tensorboard import SummaryWriter

from hoz_dist.errors import InvalidValueError
from learner.replay import UpdateRecord

RETRY_RECORDS: Final = 12
"""After a failure so many records are left out before TensorBoard's file is tried again."""


class ScalarRecorder:
    """TensorBoard scalars over frames.

    Args:
        folder: Folder of the logs.
        frames: Frames so far; what an earlier learner logged beyond them, and lost, is hidden.
    """

    def __init__(self, folder: Path, frames: int) -> None:
        self._folder = folder
        self._frames = frames
        self._writer: SummaryWriter | None = None
        self._failure: OSError | None = None
        self._left_out = 0
        """Records that are still to be left out, because of the failure."""

    def record(self, status: dict[str, Any]) -> None:
        """Write the scalars of a status, see `LearnerCore.status`.

        Raises:
            OSError: The disk is full, for example; or was, and it is not yet tried again.
        """
        if self._failure is not None and self._left_out:
            self._left_out -= 1
            raise self._failure
        try:
            if self._writer is None:
                self._writer = SummaryWriter(str(self._folder), purge_step=self._frames or None)
            self._add(self._writer, status)
            self._writer.flush()
        except OSError as error:
            # TensorBoard's thread has ended; a new writer begins a new file.
            self.close()
            self._failure, self._left_out, self._frames = error, RETRY_RECORDS, status["frames"]
            raise

    def close(self) -> None:
        """Write what is still in memory, if the disk takes it."""
        if self._writer is not None:
            with contextlib.suppress(OSError):
                self._writer.close()
        self._writer = None

    @staticmethod
    def _add(writer: SummaryWriter, status: dict[str, Any]) -> None:
        success, lag = status["success"], status["lag"]
        scalars: dict[str, float | None] = {
            "n_frames": status["frames"],
            "n_episodes": status["episodes"],
            "success/train": success["overall"],
            "perf/_fps": status["frames_per_second"],
            "train/version": status["version"],
            "train/version_diff_min": lag["min"],
            "train/version_diff_avg": lag["mean"],
            "train/version_diff_max": lag["max"],
            "train/learning_rate": status["learning_rate"],
        }
        scalars |= {f"success_{scene}/train": rate for scene, rate in success["scenes"].items()}
        scalars |= {f"loss/{name}": value for name, value in status["losses"].items()}
        for tag, value in scalars.items():
            if value is not None:
                writer.add_scalar(tag, value, status["frames"])


class UpdateLog:
    """The record of the updates that are applied in one epoch, see `learner.replay`.

    Lines stay in memory until they are on the disk: what was handed to the operating system can still be lost, which
    only `sync` learns. That is one line of about 100 bytes for each update since the last checkpoint, or while the disk
    fails since it began to: at 100 updates a second 36 MB an hour, until the run's budget ends it.

    One thread may call `sync` while another calls the rest.

    Args:
        path: The file, which exists; nobody else writes into it.

    Raises:
        InvalidValueError: The file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._file = path.open("r+b", buffering=0)
            self._safe = self._file.seek(0, os.SEEK_END)
        except OSError as error:
            message = f"Cannot write '{path}' ({error.strerror}); mend it or choose another run folder."
            raise InvalidValueError(message) from error
        self._lines = bytearray()
        """What follows the first ``_safe`` bytes of the file."""
        self._handed = 0
        """Bytes of them that were handed to the operating system."""
        self._lock = threading.Lock()

    def write(self, record: UpdateRecord) -> None:
        """Add an update; it is in the file after the next `flush`, and on the disk after the next `sync`."""
        line = record.to_line().encode()
        with self._lock:
            self._lines += line

    def flush(self) -> None:
        """Hand all lines to the operating system.

        Raises:
            OSError: The disk is full, for example; the next call tries the same lines again.
        """
        with self._lock:
            # What an earlier call wrote only in part is written over.
            self._file.seek(self._safe + self._handed)
            left = memoryview(bytes(self._lines[self._handed :]))
            while left:
                left = left[self._file.write(left) :]
            self._handed = len(self._lines)

    def sync(self) -> None:
        """Wait until what was flushed is on the disk.

        Raises:
            OSError: It may be lost, in part or whole; the next `flush` writes all of it again.
        """
        with self._lock:
            handed = self._handed
        try:
            os.fsync(self._file.fileno())
        except OSError:
            with self._lock:
                # The system says this once, and forgets what it could not write.
                self._handed = 0
            raise
        with self._lock:
            del self._lines[:handed]
            self._safe += handed
            self._handed -= handed

    def close(self) -> None:
        """Close the file; lines that were not flushed are lost."""
        self._file.close()
