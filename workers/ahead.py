"""Work that goes on while its owner does something else."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Final, Generic, TypeVar

from hoz_dist.closing import Closing

CLOSE_S: Final = 5.0
"""How long work that is under way may take to end; pushes end at once when their process is to stop, seconds."""

T = TypeVar("T")


class Ahead(Closing, Generic[T]):
    """Does one piece of work at a time in a thread of its own.

    Args:
        name: Of the thread.
    """

    def __init__(self, name: str) -> None:
        self._tasks: SimpleQueue[tuple[Future[T], Callable[[], T]] | None] = SimpleQueue()
        self._under_way: Future[T] | None = None
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self, work: Callable[[], T]) -> None:
        """Begin a piece of work; the result of the one before has been asked for."""
        if self._thread.ident is None:
            self._thread.start()
        self._under_way = Future()
        self._tasks.put((self._under_way, work))

    def result(self) -> T | None:
        """Wait for the work that was begun last, and return its result once; then, and before the first, None.

        Raises:
            BaseException: What the work has raised.
        """
        future, self._under_way = self._under_way, None
        return None if future is None else future.result()

    def close(self) -> None:
        """Begin nothing more, and wait a moment for what is under way: what it works with may be closed next."""
        self._tasks.put(None)
        if self._thread.ident is not None:
            self._thread.join(CLOSE_S)

    def _run(self) -> None:
        while (task := self._tasks.get()) is not None:
            future, work = task
            try:
                future.set_result(work())
            # All of them: a panic in native code is no `Exception`, and who asks must not wait for a dead thread.
            except BaseException as error:  # noqa: BLE001 - handed to who asks for the result
                future.set_exception(error)
