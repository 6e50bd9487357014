"""A file of JSON lines that an actor writes on request."""

import json
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from hoz_dist.closing import Closing
from hoz_dist.errors import InvalidValueError


class JsonLines(Closing):
    """Appends JSON lines to a file, each flushed at once, so that a killed actor loses none; from any thread.

    Args:
        path: The file; made when it is not there.
        name: What is in it, and the option that named it.

    Raises:
        InvalidValueError: It cannot be written.
    """

    def __init__(self, path: Path, name: str) -> None:
        self._path = path
        self._name = name
        self._whole = threading.Lock()
        """Held while a line is written: two threads' must not run into each other."""
        try:
            self._file = path.open("a", encoding="utf-8")
        except OSError as error:
            raise self._cannot_write(error) from error

    def write(self, line: Mapping[str, object]) -> None:
        """Append a line.

        Raises:
            InvalidValueError: The file cannot be written any more.
        """
        try:
            with self._whole:
                self._file.write(json.dumps(line) + "\n")
                self._file.flush()
        except OSError as error:
            raise self._cannot_write(error) from error

    def close(self) -> None:
        """Close the file."""
        with suppress(OSError):  # said already, when the line was written
            self._file.close()

    def _cannot_write(self, error: OSError) -> InvalidValueError:
        message = (
            f"Cannot write the {self._name} '{self._path}' ({error.strerror}); choose another file with --{self._name}."
        )
        return InvalidValueError(message)
