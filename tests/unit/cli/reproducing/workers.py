"""A stand-in for processes of `hoz-dist reproduce`."""

from typing import Any


class Worked:
    """A worker that has ended, and what it sent: each list when it is asked once more."""

    def __init__(self, status: int, *sent: list[Any]) -> None:
        self.connection = object()
        self.exit_status = status
        self._sent = iter(sent)

    def receive(self) -> list[Any]:
        return next(self._sent, [])

    def terminate(self) -> None:
        pass

    def join(self) -> None:
        pass
