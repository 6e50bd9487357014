"""Writing files so that a reader, or a restart after a crash, finds either the old or the new one, never a part."""

import os
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Final

from hoz_dist.errors import InvalidValueError, NotFoundError

TEMPORARY_SUFFIX: Final = ".tmp"
"""Of the files that a killed process may leave."""


def replace_file(path: Path, write: Callable[[Path], object], via: Path | None = None) -> None:
    """Write a file under a temporary name, then give it its name; wait until both are on the disk.

    Several processes may replace one file at once: the last wins.

    Args:
        path: The file to make or replace.
        write: Writes the temporary file that it is given.
        via: Folder for the temporary file, on the same file system; None for that of the file.

    Raises:
        OSError: The disk is full, the folder cannot be written, ...
    """
    # Without the file's name, which may be as long as the system allows.
    temporary = (via or path.parent) / f".{uuid.uuid4().hex}{TEMPORARY_SUFFIX}"
    try:
        write(temporary)
        flush_to_disk(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    flush_to_disk(path.parent)


def remove_left_overs(folder: Path) -> None:
    """Delete what killed processes left half-written in a folder in which nobody else writes now.

    Raises:
        OSError: The folder cannot be written.
    """
    for left_over in folder.glob(f"*{TEMPORARY_SUFFIX}"):
        left_over.unlink(missing_ok=True)


def check_writable(path: Path, *, overwrite: bool) -> None:
    """Check, before long work, that a user's file can be written.

    Args:
        path: The file.
        overwrite: Whether an existing file may be replaced.

    Raises:
        NotFoundError: Its folder does not exist.
        InvalidValueError: It is a folder, or exists and must not be replaced.
    """
    if path.is_dir():
        message = f"'{path}' is a folder; name a file to write."
        raise InvalidValueError(message)
    if not path.parent.is_dir():
        message = f"The folder '{path.parent}' does not exist; create it first."
        raise NotFoundError(message)
    if path.exists() and not overwrite:
        message = f"'{path}' exists already; choose another name, or overwrite it with --force."
        raise InvalidValueError(message)


def write_atomically(path: Path, content: bytes, *, overwrite: bool) -> None:
    """Write a user's file with `replace_file`.

    Args:
        path: The file.
        content: What it shall hold.
        overwrite: Whether an existing file may be replaced.

    Raises:
        NotFoundError: Its folder does not exist.
        InvalidValueError: It is a folder, exists and must not be replaced, or the system refuses to write it.
    """
    try:
        check_writable(path, overwrite=overwrite)
        replace_file(path, lambda temporary: temporary.write_bytes(content))
    except OSError as error:
        message = f"Cannot write '{path}': {error.strerror}."
        raise InvalidValueError(message) from error


def flush_to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
