"""Membership: who holds a live token. A killed process loses its token within milliseconds."""

import logging
from typing import Final, NamedTuple

import zenoh
from zenoh import LivelinessToken, Session
from zenoh.handlers import FifoChannel

from hoz_dist.closing import Closing
from hoz_dist.wire.draining import Drain
from hoz_dist.wire.keys import NAME_PATTERN, Keys, check_name

_log = logging.getLogger(__name__)
MOST_MEMBERS: Final = 4096
"""So many are watched; invented tokens cannot fill the memory, or make the status too long to travel."""


class Member(NamedTuple):
    """A process that takes part in a run."""

    role: str
    """``learner`` or ``actor``."""
    id: str
    """Its name."""


def declare_alive(session: Session, keys: Keys, member: Member) -> LivelinessToken:
    """Declare a token that lives as long as the session; use it in a ``with`` statement or keep it.

    Raises:
        InvalidValueError: The role or the name is not fit for a key.
    """
    key = keys.alive(check_name("role", member.role), check_name("process", member.id))
    return session.liveliness().declare_token(key)


class Members(Closing):
    """Follows who takes part in a run.

    Args:
        session: Session to watch on.
        keys: Keys of the run.
    """

    def __init__(self, session: Session, keys: Keys) -> None:
        self._members: frozenset[Member] = frozenset()
        # `history` reports the tokens that exist already; a get beside it would find none (measured).
        subscriber = session.liveliness().declare_subscriber(keys.all_alive, FifoChannel(1024), history=True)
        self._drain = Drain(subscriber, self._follow, "follows members")

    def current(self) -> tuple[Member, ...]:
        """Return who holds a token now, sorted."""
        return tuple(sorted(self._members))

    def close(self) -> None:
        """Stop watching."""
        self._drain.close()

    def _follow(self, change: zenoh.Sample) -> None:
        role, name = str(change.key_expr).split("/")[-2:]
        if not (NAME_PATTERN.fullmatch(role) and NAME_PATTERN.fullmatch(name)):
            return  # a stranger's token: none of our processes has such a name
        if change.kind == zenoh.SampleKind.PUT:
            if len(self._members) >= MOST_MEMBERS:
                _log.warning("%s %s is not watched: there are %d members already", role, name, MOST_MEMBERS)
                return
            self._members |= {Member(role, name)}
            _log.info("%s %s joined", role, name)
        else:
            self._members -= {Member(role, name)}
            _log.info("%s %s left", role, name)
