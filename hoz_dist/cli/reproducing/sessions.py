"""Notes of each start of `hoz-dist reproduce` how long it was expected to take, and took."""

import json
import signal
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from hoz_dist.atomic import replace_file

FILE: Final = "sessions.json"
"""In the folder of runs and results."""
NOTE_S: Final = 30.0
"""A session that is killed had noted this long before, at most, how long it took so far, seconds."""


class Session:
    """One start of the command, in a ``with`` statement around its work; begins now.

    Args:
        out: Folder of runs and results.
        facts: What is known of it before, as JSON values.
    """

    def __init__(self, out: Path, facts: Mapping[str, Any]) -> None:
        self._file = out / FILE
        self._before = read_sessions(out)
        if not self._before and self._file.exists():
            self._file.replace(self._file.with_suffix(".damaged"))  # for people: most of it may still be legible
        self._facts = facts
        self._began = time.monotonic()
        self._ended = threading.Event()
        self._clock = threading.Thread(target=self._note_now_and_then, daemon=True)

    @property
    def seconds(self) -> float:
        """Since it began."""
        return time.monotonic() - self._began

    def __enter__(self) -> Self:
        self._note()
        self._clock.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._clock.join()
        with suppress(OSError):  # no result hangs on it, and what ended the session is to be known
            self._note(finished=error is None)

    def _note_now_and_then(self) -> None:
        # Ctrl-C is for the main thread, which now and then keeps it out.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        while not self._ended.wait(NOTE_S):
            with suppress(OSError):  # no result hangs on it
                self._note()

    def _note(self, *, finished: bool = False) -> None:
        now = {**self._facts, "took_seconds": round(self.seconds, 1), "finished": finished}
        text = json.dumps([*self._before, now], indent=2) + "\n"
        replace_file(self._file, lambda temporary: temporary.write_text(text, "utf-8"))


def read_sessions(out: Path) -> list[dict[str, Any]]:
    """Return what was noted of earlier starts; nothing when the file is not there or damaged: no result hangs on it.

    Older ones lack `finished`, `seeds` and `rows`; of those that were stopped, `took_seconds` is None.

    Args:
        out: Folder of runs and results.
    """
    try:
        sessions = json.loads((out / FILE).read_text("utf-8"))
    except (FileNotFoundError, ValueError, RecursionError):
        return []
    return [one for one in sessions if isinstance(one, dict) and "table" in one] if isinstance(sessions, list) else []
