"""The log in the run folder, which leader and standbys share."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hoz_dist.errors import InvalidValueError


class _File(logging.FileHandler):
    """A log file whose disk may fill up; the console has the same lines."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the name is logging's
        """Lose the line."""


@contextmanager
def logged_to(path: Path, name: str) -> Iterator[None]:
    """Write what is logged into a file as well, after what is there.

    Args:
        path: The file; several processes may write into it at once.
        name: Name of this process, which is on each line.

    Raises:
        InvalidValueError: The file cannot be written.
    """
    try:
        handler = _File(path, encoding="utf-8")
    except OSError as error:
        message = f"Cannot write '{path}' ({error.strerror}); mend it or choose another run folder."
        raise InvalidValueError(message) from error
    handler.setFormatter(logging.Formatter(f"%(asctime)s %(levelname)s {name}: %(message)s"))
    handler.setLevel(logging.INFO)
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)
        with suppress(OSError):
            handler.close()
