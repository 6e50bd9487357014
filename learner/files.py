"""Writing files so that a reader, or a restart, finds either the old or the new one, never a part."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

TEMPORARY_SUFFIX: Final = ".tmp"


def replace_file(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file through a temporary one in the same folder, and flush both to the disk.

    Args:
        path: The file to make or replace.
        write: Writes the temporary file that it is given.

    Raises:
        OSError: The disk is full, the folder cannot be written, ...
    """
    temporary = path.with_name(path.name + TEMPORARY_SUFFIX)
    try:
        write(temporary)
        _flush(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    _flush(path.parent)


def _flush(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
