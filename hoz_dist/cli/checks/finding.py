"""What a check says."""

from typing import Literal, NamedTuple

State = Literal["ok", "warn", "fail"]


class Finding(NamedTuple):
    """The outcome of one check."""

    check: str
    """Name of the check, stable, for scripts."""
    state: State
    """``warn``: works, but not well; ``fail``: hoz-dist does not work."""
    found: str
    """What there is, without a full stop."""
    advice: str = ""
    """What to do about it, a sentence; empty when all is well."""

    @property
    def sentence(self) -> str:
        """The finding on one line."""
        return f"{self.check}: {self.found}. {self.advice}".rstrip()
