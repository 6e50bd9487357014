"""A run's folder: its configuration, checkpoints, logs, and the lock that keeps a second learner out."""

import json
import logging
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from filelock import FileLock, Timeout

from hoz_dist.atomic import TEMPORARY_SUFFIX, replace_file
from hoz_dist.config import RunConfig
from hoz_dist.errors import DamagedFileError, HozError, InvalidValueError, NotFoundError, RunMismatchError
from learner.checkpoint import FOLDER, Checkpoint, checkpoint_files, newest_readable

CONFIG_FILE: Final = "config.json"
LOCK_FILE: Final = "learner.lock"
EPOCH_FILE: Final = "epoch"
"""Holds the last epoch that was opened, since an epoch may end before its first checkpoint."""
UPDATES_FILE: Final = "updates.jsonl"
DAMAGED_SUFFIX: Final = ".damaged"
"""Put at the end of the name of a damaged checkpoint, which is thereby no checkpoint any more."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunFolder:
    """An open run folder. Get one from `open_run_folder`."""

    path: Path
    config: RunConfig
    epoch: int
    """The epoch of this learner: one more than that of any learner before."""
    checkpoint: Checkpoint | None
    """Where the run goes on from; None for a new run."""

    @property
    def checkpoints(self) -> Path:
        """The folder of checkpoints."""
        return self.path / FOLDER

    @property
    def tensorboard(self) -> Path:
        """The folder of TensorBoard logs."""
        return self.path / "tensorboard"

    @property
    def updates(self) -> Path:
        """The record of applied updates."""
        return self.path / UPDATES_FILE

    @property
    def log(self) -> Path:
        """The learner's log."""
        return self.path / "learner.log"


def read_config(path: Path) -> RunConfig:
    """Read the configuration of a run folder.

    Raises:
        NotFoundError: The folder is not a run.
        DamagedFileError: The configuration cannot be read.
    """
    file = path / CONFIG_FILE
    try:
        return RunConfig.from_json(json.loads(file.read_text(encoding="utf-8")))
    except FileNotFoundError as error:
        message = f"'{path}' is not a run: it has no {CONFIG_FILE}."
        raise NotFoundError(message) from error
    except (OSError, ValueError, HozError) as error:
        message = f"Cannot read '{file}' ({error}); mend it or choose another run folder."
        raise DamagedFileError(message) from error


@contextmanager
def open_run_folder(path: Path, config: RunConfig) -> Iterator[RunFolder]:
    """Make a run folder, or go on with one of the same configuration, and lock it meanwhile.

    Raises:
        InvalidValueError: The folder holds other files, cannot be written, or another learner uses it.
        RunMismatchError: The folder's run has another configuration.
        DamagedFileError: Its configuration, or every checkpoint, cannot be read.
    """
    try:
        _refuse_foreign(path)
        path.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path / LOCK_FILE, timeout=0)
        lock.acquire()
    except Timeout as error:
        message = f"Another learner is using the run folder '{path}'; stop it or choose another folder."
        raise InvalidValueError(message) from error
    except OSError as error:
        message = f"Cannot use '{path}' as a run folder ({error.strerror}); choose another folder."
        raise InvalidValueError(message) from error
    try:
        yield _opened(path, config)
    finally:
        lock.release()


def _refuse_foreign(path: Path) -> None:
    if not path.exists():
        return
    if not path.is_dir():
        message = f"'{path}' is a file; choose a folder for the run."
        raise InvalidValueError(message)
    # These are what a learner leaves that was killed before it had written the configuration.
    names = {entry.name for entry in path.iterdir() if entry.suffix != TEMPORARY_SUFFIX} - {LOCK_FILE}
    if names and CONFIG_FILE not in names:
        message = f"'{path}' holds files but is not a run; choose an empty or a new folder."
        raise InvalidValueError(message)


def _opened(path: Path, config: RunConfig) -> RunFolder:
    try:
        return _open_locked(path, config)
    except OSError as error:
        message = f"Cannot write the run folder '{path}' ({error.strerror}); mend it or choose another folder."
        raise InvalidValueError(message) from error


def _open_locked(path: Path, config: RunConfig) -> RunFolder:
    file = path / CONFIG_FILE
    if file.exists():
        differences = read_config(path).differences(config)
        if differences:
            message = (
                f"The run in '{path}' has another configuration ({'; '.join(differences)}); "
                "give the same options as before, or another run folder."
            )
            raise RunMismatchError(message)
    else:
        text = json.dumps(config.to_json(), indent=2) + "\n"
        replace_file(file, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    checkpoint = _resume(path) if checkpoint_files(path / FOLDER) else None
    epoch = 1 + max(_last_epoch(path), checkpoint.epoch if checkpoint else 0)
    replace_file(path / EPOCH_FILE, lambda temporary: temporary.write_text(f"{epoch}\n", encoding="utf-8"))
    return RunFolder(path, config, epoch, checkpoint)


def _resume(path: Path) -> Checkpoint:
    """Return the newest checkpoint that can be read; damaged newer ones are set aside, nothing is lost."""
    checkpoint, damaged = newest_readable(path / FOLDER)
    if damaged and (path / UPDATES_FILE).exists():
        # The learner will cut off the updates after the checkpoint, which may be all that is left of much training.
        record = _unused(path / f"updates-{max(file.stem for file in damaged)}.jsonl")
        shutil.copy2(path / UPDATES_FILE, record)
        _log.warning("the record of updates so far is kept as '%s'", record)
    for file, error in damaged.items():
        aside = _unused(file.with_name(file.name + DAMAGED_SUFFIX))
        file.rename(aside)
        _log.warning("%s It is kept as '%s'; going on from version %d.", error, aside, checkpoint.version)
    return checkpoint


def _unused(path: Path) -> Path:
    """Return a path where nothing is, by a number at the end of the name if need be."""
    candidates = (path, *(path.with_name(f"{path.name}.{number}") for number in range(2, 1000)))
    return next(candidate for candidate in candidates if not candidate.exists())


def _last_epoch(path: Path) -> int:
    try:
        return int((path / EPOCH_FILE).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return 0
    except (OSError, ValueError) as error:
        message = f"Cannot read '{path / EPOCH_FILE}' ({error}); write the number of the run's last epoch into it."
        raise DamagedFileError(message) from error
