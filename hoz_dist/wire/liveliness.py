"""Membership: who holds a live token, and who did. A killed process loses its token within milliseconds."""

import logging
import re
import socket
import time
from collections import deque
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
MOST_LEFT: Final = 64
"""So many that left are remembered."""
_PARTS: Final = 4
_LARGEST_INCARNATION: Final = 2**63 - 1


class Member(NamedTuple):
    """A process that takes part in a run."""

    role: str
    """``learner``, ``standby`` or ``actor``."""
    id: str
    """Its name."""
    host: str
    """Name of the machine that it runs on, fit for a key."""
    incarnation: int
    """Random number that it drew when it started."""


class Departure(NamedTuple):
    """A process that left."""

    member: Member
    time: float
    """When its token went, seconds of the monotonic clock."""


def host_name() -> str:
    """Return the name of this machine, as much of it as is fit for a key."""
    return re.sub(r"[^A-Za-z0-9._-]", "-", socket.gethostname()).lstrip("._-")[:40] or "host"


def declare_alive(session: Session, keys: Keys, member: Member) -> LivelinessToken:
    """Declare a token that lives as long as the session; use it in a ``with`` statement or keep it.

    Raises:
        InvalidValueError: The role or a name is not fit for a key.
    """
    for what, name in (("role", member.role), ("process", member.id), ("host", member.host)):
        check_name(what, name)
    return session.liveliness().declare_token(keys.alive(*member))


class Members(Closing):
    """Follows who takes part in a run.

    Args:
        session: Session to watch on.
        keys: Keys of the run.
    """

    def __init__(self, session: Session, keys: Keys) -> None:
        self._members: frozenset[Member] = frozenset()
        self._left: deque[Departure] = deque(maxlen=MOST_LEFT)
        # `history` reports the tokens that exist already; a get beside it would find none (measured).
        subscriber = session.liveliness().declare_subscriber(keys.all_alive, FifoChannel(1024), history=True)
        self._drain = Drain(subscriber, self._follow, "follows members")

    def current(self) -> tuple[Member, ...]:
        """Return who holds a token now, sorted."""
        return tuple(sorted(self._members))

    def left(self) -> tuple[Departure, ...]:
        """Return who held a token and left, the last one first; who came back is not among them."""
        return tuple(reversed(self._left.copy()))

    def close(self) -> None:
        """Stop watching."""
        self._drain.close()

    def _follow(self, change: zenoh.Sample) -> None:
        member = _member_of(str(change.key_expr))
        if member is None:
            return  # a stranger's token: none of our processes has such a key
        if change.kind == zenoh.SampleKind.PUT:
            if len(self._members) >= MOST_MEMBERS:
                _log.warning("%s %s is not watched: there are %d members already", *member[:2], MOST_MEMBERS)
                return
            self._left = deque((one for one in self._left if one.member != member), MOST_LEFT)
            self._members |= {member}
            _log.info("%s %s joined from %s", *member[:3])
        elif member in self._members:
            self._members -= {member}
            self._left.append(Departure(member, time.monotonic()))
            _log.info("%s %s left", *member[:2])


def _member_of(key: str) -> Member | None:
    """Return the process that a token belongs to; None when the key is not one of ours."""
    role, name, host, number = key.split("/")[-_PARTS:]
    if not all(NAME_PATTERN.fullmatch(part) for part in (role, name, host)):
        return None
    if not (number.isascii() and number.isdigit()) or int(number[:20]) > _LARGEST_INCARNATION:
        return None
    return Member(role, name, host, int(number))
