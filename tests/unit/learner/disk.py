"""A disk that is full, or cannot be read, for a while."""

import errno
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

PASSING = [errno.EIO, errno.EMFILE, errno.ESTALE, errno.EACCES]
"""What reading fails with although nothing is wrong with the file."""


@contextmanager
def full_disk(most_bytes: int) -> Iterator[None]:
    """Let the kernel fail every write beyond that size, as a full disk does."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextmanager
def unreadable(path: Path, number: int = errno.EIO) -> Iterator[None]:
    """Let reading a file or a folder fail; by a patch, since a superuser may read everything."""
    read_bytes, iterdir = Path.read_bytes, Path.iterdir

    def fail(file: Path) -> None:
        if file == path:
            raise OSError(number, os.strerror(number), str(file))

    def read(file: Path) -> bytes:
        fail(file)
        return read_bytes(file)

    def names(folder: Path) -> Iterator[Path]:
        fail(folder)
        return iterdir(folder)

    with patch.object(Path, "read_bytes", read), patch.object(Path, "iterdir", names):
        yield
