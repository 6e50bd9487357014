"""The errors that a user of hoz-dist can cause or must know of.

Every message is one sentence that says what is wrong and what to do. The command line prints it and exits with status
2.

    HozError
    ├── UnknownNameError      a scene, room, category, method, ... that does not exist
    ├── InvalidValueError     a value out of its range, or options that contradict each other
    ├── DamagedFileError      a file that cannot be read as what it should be
    ├── NotFoundError         a file, run or graph that is not there (yet)
    ├── RunMismatchError      a run folder that belongs to another configuration
    └── ConnectionFailedError no router, no learner, or no answer at an endpoint

Apart from these stands OwnMistakeError, which no user can mend; the status is then 1.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class HozError(Exception):
    """Base of all errors that are the caller's to mend."""


class UnknownNameError(HozError):
    """A name that is not one of the known ones."""

    @classmethod
    def of(cls, kind: str, name: str, known: Iterable[str]) -> "UnknownNameError":
        """Make the error for ``name``, with the known names and the closest one.

        Args:
            kind: What the name stands for, for example ``"scene"``.
            name: The name that was given.
            known: The names that exist.
        """
        names = list(known)
        close = get_close_matches(name.lower(), [n.lower() for n in names], n=1)
        hint = next((f" Did you mean '{n}'?" for n in names if close and n.lower() == close[0]), "")
        return cls(f"Unknown {kind} '{name}'.{hint} Known: {', '.join(names)}.")


class InvalidValueError(HozError):
    """A value that is out of range, or values that contradict each other."""


class DamagedFileError(HozError):
    """A file that cannot be read as what it should be."""


class NotFoundError(HozError):
    """A file, run or graph that is not there."""


class RunMismatchError(HozError):
    """A run folder that holds a run of another configuration."""


class ConnectionFailedError(HozError):
    """No router, no learner, or no answer at an endpoint."""


class OwnMistakeError(Exception):
    """A process of ours failed as none should; what it wrote tells us more."""
