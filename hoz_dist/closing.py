"""Context managers that close what they are."""

from types import TracebackType
from typing import Self


class Closing:
    """Base of classes whose ``with`` statement ends with `close`."""

    def close(self) -> None:
        """Let go of everything; to be defined by each class."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
