"""Writing checkpoints beside the training: in another thread, and again when it fails."""

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Final

from hoz_dist.errors import HozError
from hoz_dist.outage import Outage
from learner.checkpoint import Checkpoint, Files, save_checkpoint
from learner.leadership import DeposedError

RETRY_S: Final = 5.0
"""Time until a checkpoint that could not be written is tried again."""

_log = logging.getLogger(__name__)


class CheckpointWriter:
    """Writes checkpoints. Only the thread that trains may call its methods.

    Saves that are asked for while one is written become one save after it.

    Args:
        folder: The folder of checkpoints.
        snapshot: Copies the state of the run as it is at a time; an `OSError` of it is a save that failed.
        files: How to change the files of the folder.
        before: Called with the snapshot taken, in the thread that writes, before the checkpoint is; likewise.
    """

    def __init__(
        self,
        folder: Path,
        snapshot: Callable[[float], Checkpoint],
        files: Files,
        before: Callable[[], None] = lambda: None,
    ) -> None:
        self._folder = folder
        self._snapshot = snapshot
        self._files = files
        self._before = before
        self._thread = ThreadPoolExecutor(1, "hoz-checkpoint")
        self._writing: Future[Path] | None = None
        self._due: float | None = None
        """When to save next; None when nothing is to be saved."""
        self._keep = False
        """Whether the next checkpoint is one to keep."""
        self._keeping = False
        """Whether the one that is written now is."""
        self._outage = Outage(_log, "cannot save a checkpoint (%s); training on and trying again", "saved a checkpoint")

    def save(self, now: float, *, keep: bool) -> None:
        """Save as soon as the checkpoint before is written.

        Args:
            now: The time.
            keep: Never delete the checkpoint to make room for newer ones.
        """
        self._keep |= keep
        self._due = now
        self.poll(now)

    def poll(self, now: float) -> None:
        """Notice how the last save ended, and begin the next when it is due; never waits."""
        if self._writing is not None and self._writing.done():
            self._finish(self._writing, now)
        if self._writing is None and self._due is not None and now >= self._due:
            self._due = None
            self._keeping, self._keep = self._keep, False
            try:
                checkpoint = self._snapshot(now)
            except OSError as error:
                self._try_again(error, now)
            else:
                self._writing = self._thread.submit(self._write, checkpoint, keep=self._keeping)

    def abandon(self) -> None:
        """Stop without saving, once the checkpoint that is being written is, or has failed to be."""
        self._thread.shutdown()

    def close(self, now: float) -> Path:
        """Save a last checkpoint.

        Returns:
            The file.

        Raises:
            DeposedError: Another learner leads the run by now.
            HozError: It could not be written.
        """
        self._thread.shutdown()
        if self._writing is not None:
            self._finish(self._writing, now)
        try:
            return self._write(self._snapshot(now), keep=self._keep)
        except OSError as error:
            message = (
                f"Cannot save the last checkpoint in '{self._folder}' ({error.strerror or error}); "
                "make room, and run the same command to go on from the one before."
            )
            raise HozError(message) from error

    def _write(self, checkpoint: Checkpoint, *, keep: bool) -> Path:
        self._before()
        return save_checkpoint(self._folder, checkpoint, keep=keep, files=self._files)

    def _finish(self, writing: "Future[Path]", now: float) -> None:
        self._writing = None
        try:
            writing.result()
        except DeposedError:
            _log.warning("another learner leads the run by now: the checkpoint was not saved")
        except OSError as error:
            self._try_again(error, now)
        else:
            self._outage.worked()

    def _try_again(self, error: OSError, now: float) -> None:
        # Training on and trying again loses less than stopping would.
        self._outage.failed(error)
        self._due = now + RETRY_S
        self._keep |= self._keeping
