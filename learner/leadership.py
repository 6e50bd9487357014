"""Who leads a run. The run folder is the arbiter; nobody has to be asked, and nobody who stands still is waited for.

Leaders follow one another in epochs, which are claimed one by one. ``epochs/0002`` is the folder of the second:

    leader.lock   locked by the leader as long as it lives, so that others can tell whether it does
    writing/      where the leader writes each file of the run before it is renamed into its place
    all-before/   says that all earlier epochs were fenced, see below

A claim is the renaming of a prepared folder to ``epochs/0002``, with the lock held already: a system call that succeeds
for one claimer only. The new leader then renames the ``writing`` folder of the one before, and thereby *fences* it:
whatever an old leader still wants to put into the run, or delete from it, fails, however late it wakes up. So there is
no moment at which a leader has checked that it leads and acts on it later, and no lock that a stopped process can hold.
"""

import errno
import fcntl
import os
import shutil
import uuid
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

from hoz_dist.atomic import TEMPORARY_SUFFIX, flush_to_disk, replace_file
from hoz_dist.closing import Closing
from hoz_dist.errors import HozError

EPOCHS_FOLDER: Final = "epochs"
EPOCH_FILE: Final = "epoch"
"""Holds the number of the newest epoch: what a leader looks at to learn that it is deposed."""
_LOCK_FILE: Final = "leader.lock"
_WRITING: Final = "writing"
_FENCED: Final = "fenced"
_ALL_BEFORE: Final = "all-before"
_TAKEN: Final = (errno.ENOTEMPTY, errno.EEXIST)
"""What renaming a folder to the name of another one that is not empty ends with."""


class DeposedError(HozError):
    """A learner that no longer leads wanted to change the run.

    Args:
        run: The run folder.
        epoch: Epoch that it led.
    """

    def __init__(self, run: Path, epoch: int) -> None:
        super().__init__(
            f"Another learner leads the run in '{run}' by now, so the one of epoch {epoch} ended and saved nothing "
            "more; with a router, --connect and --standby they take turns."
        )


def newest_epoch(run: Path) -> int:
    """Return the newest epoch that was claimed, whether anybody leads it or not; 0 when none was."""
    try:
        names = [folder.name for folder in (run / EPOCHS_FOLDER).iterdir()]
    except FileNotFoundError:
        return 0
    return max((int(name) for name in names if name.isdecimal()), default=0)


def is_held(run: Path, epoch: int) -> bool:
    """Tell whether the process that claimed an epoch lives, and has not ended its leadership."""
    try:
        lock = os.open(_folder(run, epoch) / _LOCK_FILE, os.O_RDWR)
    except FileNotFoundError:
        return False
    try:
        # Shared, so that two processes that look at once do not take each other for the leader.
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    else:
        return False
    finally:
        os.close(lock)


def claim(run: Path, after: int) -> "Leadership | None":
    """Claim the epoch after another one, and fence all leaders before.

    Args:
        run: The run folder.
        after: The newest epoch as the claimer knows it.

    Returns:
        The leadership, to be closed; None when another claimer was faster.

    Raises:
        OSError: The run folder cannot be written.
    """
    epoch, epochs = after + 1, run / EPOCHS_FOLDER
    epochs.mkdir(exist_ok=True)
    prepared = epochs / f".{uuid.uuid4().hex}{TEMPORARY_SUFFIX}"
    (prepared / _WRITING).mkdir(parents=True)
    leadership = Leadership(run, epoch, _locked(prepared / _LOCK_FILE))
    try:
        prepared.rename(_folder(run, epoch))
        flush_to_disk(epochs)
        _fence_before(run, epoch)
        if newest_epoch(run) > epoch:
            # Numbers are left out when checkpoints of later epochs were copied here, so that a claimer that was stopped
            # for long finds its own still free. Who claimed the newer one may have looked for this one too early.
            _fence(_folder(run, epoch))
        # Only now, that no older claimer can: it may have been stopped at this very line and wake up late.
        leadership.replace(run / EPOCH_FILE, lambda temporary: temporary.write_text(f"{epoch}\n", encoding="utf-8"))
    except DeposedError:
        leadership.close()
        return None
    except OSError as error:
        leadership.close()
        if error.errno in _TAKEN:
            return None
        raise
    finally:
        shutil.rmtree(prepared, ignore_errors=True)
    return leadership


class Leadership(Closing):
    """The right to change a run, as long as nobody else claims it; `claim` gives it.

    Args:
        run: The run folder.
        epoch: The epoch.
        lock: Descriptor of the locked file.

    Attributes:
        epoch: The epoch.
    """

    def __init__(self, run: Path, epoch: int, lock: int) -> None:
        self.epoch = epoch
        self._run = run
        self._lock: int | None = lock
        self._writing = _folder(run, epoch) / _WRITING

    @property
    def deposed(self) -> bool:
        """Whether another learner has claimed a newer epoch; looks for a folder and reads one small file.

        Raises:
            OSError: The run folder cannot be read, so that nobody can tell.
        """
        # The claimer may have been killed before it wrote the file. But looking for a folder is answered from memory on
        # a shared file system, whereas opening a file asks the server.
        if self._fenced:
            return True
        try:
            return int((self._run / EPOCH_FILE).read_text(encoding="utf-8")) != self.epoch
        except (FileNotFoundError, ValueError):
            return False  # somebody has spoilt the file

    def replace(self, path: Path, write: Callable[[Path], object]) -> None:
        """Make or replace a file of the run, as `replace_file` does.

        Raises:
            DeposedError: This leadership is over; the file is as it was.
            OSError: The disk is full, the folder cannot be written, ...
        """
        try:
            replace_file(path, write, via=self._writing)
        except Exception as error:
            if self._fenced:
                raise DeposedError(self._run, self.epoch) from error
            raise

    def remove(self, path: Path) -> None:
        """Delete a file of the run, if it is there.

        Raises:
            DeposedError: This leadership is over; the file is as it was.
            OSError: The folder cannot be written.
        """
        aside = self._writing / f".{uuid.uuid4().hex}{TEMPORARY_SUFFIX}"
        try:
            path.rename(aside)
        except FileNotFoundError as error:
            if self._fenced:
                raise DeposedError(self._run, self.epoch) from error
        else:
            aside.unlink(missing_ok=True)

    def close(self) -> None:
        """Let others see that nobody leads any more."""
        lock, self._lock = self._lock, None
        if lock is not None:
            os.close(lock)

    @property
    def _fenced(self) -> bool:
        return not self._writing.is_dir()


def _folder(run: Path, epoch: int) -> Path:
    return run / EPOCHS_FOLDER / f"{epoch:04d}"


def _locked(path: Path) -> int:
    """Make a file and lock it until the descriptor that is returned is closed."""
    lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        raise
    return lock


def _fence_before(run: Path, epoch: int) -> None:
    """Fence the leaders of all earlier epochs, the newest first.

    A fence is never taken away, and no earlier epoch can be claimed any more by one who would lead. So the claimer that
    was done with it leaves a mark in its own epoch, at which the next ones stop; one that died before left none.
    """
    for older in range(epoch - 1, 0, -1):
        _fence(_folder(run, older))
        if (_folder(run, older) / _ALL_BEFORE).is_dir():
            break
    (_folder(run, epoch) / _ALL_BEFORE).mkdir(exist_ok=True)


def _fence(folder: Path) -> None:
    """Take away the folder through which the leader of an epoch changes the run.

    A system call of the old leader that had found the folder just before is still under way then; deleting what lies
    in it leaves that call nothing to rename. Whatever it achieved before is seen by those who look from now on.
    """
    fenced = folder / _FENCED
    with suppress(FileNotFoundError):
        (folder / _WRITING).rename(fenced)
    if fenced.is_dir():
        for file in fenced.iterdir():
            file.unlink(missing_ok=True)
        with suppress(OSError):  # a claimer that was faster, or a file system that keeps open files under another name
            fenced.rmdir()
