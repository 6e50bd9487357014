"""Writing files so that a reader or a crash never finds half of one."""

import os
import uuid
from pathlib import Path

from hoz_dist.errors import InvalidValueError, NotFoundError


def check_writable(path: Path, *, overwrite: bool) -> None:
    """Check, before long work, that a file can be written.

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
    """Write a file under a temporary name in the same folder, then give it its name.

    Args:
        path: The file.
        content: What it shall hold.
        overwrite: Whether an existing file may be replaced.

    Raises:
        NotFoundError: Its folder does not exist.
        InvalidValueError: It is a folder, exists and must not be replaced, or the system refuses to write it.
    """
    temporary = path.with_name(f".{uuid.uuid4().hex}.tmp")
    try:
        check_writable(path, overwrite=overwrite)
        with temporary.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        message = f"Cannot write '{path}': {error.strerror}."
        raise InvalidValueError(message) from error
    finally:
        temporary.unlink(missing_ok=True)
