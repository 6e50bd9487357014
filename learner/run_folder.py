"""A run's folder: its configuration, its checkpoints, its logs, and how a learner takes it over."""

import json
import logging
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from hoz_dist.atomic import TEMPORARY_SUFFIX, flush_to_disk
from hoz_dist.config import RunConfig
from hoz_dist.errors import DamagedFileError, HozError, InvalidValueError, NotFoundError, RunMismatchError
from learner.checkpoint import (
    FOLDER,
    Checkpoint,
    Stamp,
    UnreadableError,
    checkpoint_files,
    newest_readable,
    reading,
)
from learner.leadership import EPOCH_FILE, EPOCHS_FOLDER, Leadership, claim, is_held, newest_epoch
from learner.replay import UPDATES_FOLDER, EpochStart

CONFIG_FILE: Final = "config.json"
DAMAGED_SUFFIX: Final = ".damaged"
"""Put at the end of the name of a damaged checkpoint, which is thereby no checkpoint any more."""
_CLAIMS: Final = 10
"""Claims that a learner may lose to others before it gives in."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunFolder:
    """A run folder and the configuration that its run shall have.

    Attributes:
        path: The folder; `check` says whether it can be used, `make` makes it.
        config: The configuration.
    """

    path: Path
    config: RunConfig

    @property
    def checkpoints(self) -> Path:
        """The folder of checkpoints."""
        return self.path / FOLDER

    @property
    def tensorboard(self) -> Path:
        """The folder of TensorBoard logs."""
        return self.path / "tensorboard"

    @property
    def log(self) -> Path:
        """The log of all learners."""
        return self.path / "learner.log"

    def check(self) -> None:
        """Look whether the folder can be that of the run, without changing anything.

        Raises:
            InvalidValueError: It holds other files.
            RunMismatchError: Its run has another configuration.
            DamagedFileError: Its configuration is damaged.
            UnreadableError: It cannot be read now.
        """
        with reading(self.path):
            _refuse_foreign(self.path)
            if not (self.path / CONFIG_FILE).exists():
                return
        differences = read_config(self.path).differences(self.config)
        if differences:
            message = (
                f"The run in '{self.path}' has another configuration ({'; '.join(differences)}); "
                "give the same options as before, or another run folder."
            )
            raise RunMismatchError(message)

    def check_going_on(self, read: Callable[[Path], Checkpoint] | None = None) -> None:
        """Look whether the run could be taken over, without changing anything: a take-over uses an epoch up.

        Args:
            read: As in `take_over`.

        Raises:
            HozError: What `take_over` would raise.
        """
        self.check()
        self._newest(read)

    def make(self) -> None:
        """Make the folder if it is not there.

        Raises:
            InvalidValueError: It cannot be made.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            message = f"Cannot use '{self.path}' as a run folder ({error.strerror}); choose another folder."
            raise InvalidValueError(message) from error

    def newest_epoch(self) -> int:
        """Return the newest epoch of the run; 0 before the first.

        Raises:
            UnreadableError: The folder cannot be read now.
        """
        with reading(self.path):
            # Checkpoints that were copied into a new folder have had epochs elsewhere.
            stamps = (Stamp.of(file) for file in checkpoint_files(self.checkpoints)[:1])
            return max(newest_epoch(self.path), *(stamp.epoch for stamp in stamps if stamp is not None), 0)

    def is_held(self, epoch: int) -> bool:
        """Tell whether the learner that claimed an epoch lives, and has not ended its leadership.

        Raises:
            UnreadableError: The folder cannot be read now.
        """
        with reading(self.path):
            return is_held(self.path, epoch)

    def claim(self, after: int) -> Leadership | None:
        """Claim the epoch after another one; None when another learner was faster.

        Raises:
            InvalidValueError: The folder cannot be written.
        """
        try:
            return claim(self.path, after)
        except OSError as error:
            raise self._unwritable(error) from error

    def claim_or_refuse(self, read: Callable[[Path], Checkpoint] | None = None) -> Leadership:
        """Claim a new epoch, unless somebody leads or the run could not be taken over.

        Args:
            read: As in `take_over`.

        Raises:
            InvalidValueError: Another learner leads the run, or the folder cannot be written.
            HozError: What `take_over` would raise.
        """
        for _ in range(_CLAIMS):
            newest = self.newest_epoch()
            if self.is_held(newest):
                break
            self.check_going_on(read)
            leadership = self.claim(newest)
            if leadership is not None:
                return leadership
        message = f"Another learner is using the run folder '{self.path}'; stop it or choose another folder."
        raise InvalidValueError(message)

    def take_over(self, leadership: Leadership, read: Callable[[Path], Checkpoint] | None = None) -> "LedRun":
        """Go on with the run, or begin it.

        Args:
            leadership: The right to do so.
            read: Reads a checkpoint, when it is not to be `load_checkpoint`.

        Raises:
            DeposedError: Another learner has claimed the run meanwhile.
            InvalidValueError: The folder cannot be written.
            RunMismatchError: The folder's run has another configuration.
            DamagedFileError: Its configuration, or every checkpoint, is damaged.
            UnreadableError: Its configuration, or a checkpoint newer than all that can be read, cannot be read now;
                no checkpoint was set aside.
        """
        self.check()
        try:
            if not (self.path / CONFIG_FILE).exists():
                text = json.dumps(self.config.to_json(), indent=2) + "\n"
                leadership.replace(self.path / CONFIG_FILE, lambda temporary: temporary.write_text(text, "utf-8"))
            checkpoint = self._resume(read)
            start = EpochStart(leadership.epoch, checkpoint.version if checkpoint is not None else 0)
            updates = self.path / UPDATES_FOLDER / start.file_name
            updates.parent.mkdir(exist_ok=True)
            flush_to_disk(self.path)
            leadership.replace(updates, lambda temporary: temporary.write_text(start.to_line(), "utf-8"))
        except OSError as error:
            raise self._unwritable(error) from error
        return LedRun(self, leadership, checkpoint, updates)

    def _newest(
        self, read: Callable[[Path], Checkpoint] | None
    ) -> tuple[Checkpoint | None, dict[Path, DamagedFileError]]:
        """Return the newest checkpoint that is not damaged, if there is any, and the newer ones that are."""
        try:
            return newest_readable(self.checkpoints, read)
        except NotFoundError:
            return None, {}

    def _resume(self, read: Callable[[Path], Checkpoint] | None) -> Checkpoint | None:
        """Return where the run goes on from; damaged newer checkpoints are set aside, nothing is lost."""
        checkpoint, damaged = self._newest(read)
        if checkpoint is None:
            return None
        for file, error in damaged.items():
            aside = _unused(file.with_name(file.name + DAMAGED_SUFFIX))
            with suppress(FileNotFoundError):  # a learner of a newer epoch was faster
                file.rename(aside)
            _log.warning("%s It is kept as '%s'; going on from version %d.", error, aside, checkpoint.version)
        return checkpoint

    def _unwritable(self, error: OSError) -> InvalidValueError:
        return InvalidValueError(
            f"Cannot write the run folder '{self.path}' ({error.strerror}); mend it or choose another folder."
        )


@dataclass(frozen=True)
class LedRun:
    """A run that this process leads."""

    folder: RunFolder
    leadership: Leadership
    checkpoint: Checkpoint | None
    """Where the run goes on from; None for a new run."""
    updates: Path
    """The record of this epoch's updates."""


def read_config(path: Path) -> RunConfig:
    """Read the configuration of a run folder.

    Raises:
        NotFoundError: The folder is not a run.
        DamagedFileError: The configuration is damaged.
        UnreadableError: It cannot be read now.
    """
    file = path / CONFIG_FILE
    try:
        return RunConfig.from_json(json.loads(file.read_text(encoding="utf-8")))
    except FileNotFoundError as error:
        message = f"'{path}' is not a run: it has no {CONFIG_FILE}."
        raise NotFoundError(message) from error
    except OSError as error:
        raise UnreadableError(file, error) from error
    except HozError as error:
        message = f"'{file}' cannot be used: {error}"
        raise DamagedFileError(message) from error
    except ValueError as error:
        message = f"Cannot read '{file}' ({error}); mend it or choose another run folder."
        raise DamagedFileError(message) from error


def _refuse_foreign(path: Path) -> None:
    try:
        if not path.exists():
            return
        names = {entry.name for entry in path.iterdir() if entry.suffix != TEMPORARY_SUFFIX}
    except NotADirectoryError as error:
        message = f"'{path}' is a file; choose a folder for the run."
        raise InvalidValueError(message) from error
    # These are what a learner leaves that was killed before it had written the configuration.
    names -= {EPOCHS_FOLDER, EPOCH_FILE, "learner.log"}
    if names and CONFIG_FILE not in names:
        message = f"'{path}' holds files but is not a run; choose an empty or a new folder."
        raise InvalidValueError(message)


def _unused(path: Path) -> Path:
    """Return a path where nothing is, by a number at the end of the name if need be."""
    candidates = (path, *(path.with_name(f"{path.name}.{number}") for number in range(2, 1000)))
    return next(candidate for candidate in candidates if not candidate.exists())
