"""Membership: who holds a live token, and who did. A killed process loses its token within milliseconds."""

import logging
import re
import socket
import time
from typing import Final

import zenoh
from zenoh import LivelinessToken, Session
from zenoh.handlers import FifoChannel

from hoz_dist.closing import Closing
from hoz_dist.wire.membership.roster import MOST_LIVE, Departure, Member, Roster
from hoz_dist.wire.protocol.keys import NAME_PATTERN, Keys, check_name
from hoz_dist.wire.protocol.schema import MAX_INT
from hoz_dist.wire.transport.draining import Drain

__all__ = ["Departure", "Member", "Members", "declare_alive", "host_name"]

MOST_LINES: Final = 100
"""Log lines on members in `LINES_S`; strangers that come and go cannot fill the disk."""
LINES_S: Final = 10.0
_log = logging.getLogger(__name__)
_PARTS: Final = 4
_INCARNATION: Final = re.compile(r"0|[1-9][0-9]{0,18}")


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
        self._roster = Roster()
        self._lines_since = float("-inf")
        self._lines = 0
        # `history` reports the tokens that exist already; a get beside it would find none (measured).
        subscriber = session.liveliness().declare_subscriber(keys.all_alive, FifoChannel(1024), history=True)
        self._drain = Drain(subscriber, self._follow, "follows members")

    def current(self) -> tuple[Member, ...]:
        """Return who holds a token now, sorted."""
        return self._roster.live()

    def left(self) -> tuple[Departure, ...]:
        """Return who held a token and left, the last one first; who came back is not among them."""
        return self._roster.left()

    def close(self) -> None:
        """Stop watching."""
        self._drain.close()

    def _follow(self, change: zenoh.Sample) -> None:
        member = _member_of(str(change.key_expr))
        if member is None:
            return  # a stranger's token: none of our processes has such a key
        if change.kind == zenoh.SampleKind.PUT:
            if self._roster.join(member):
                self._say(logging.INFO, "%s %s joined from %s", *member[:3])
            else:
                self._say(logging.WARNING, "%s %s is not watched: there are too many like it", *member[:2])
        elif self._roster.leave(member, time.monotonic()):
            self._say(logging.INFO, "%s %s left", *member[:2])

    def _say(self, level: int, line: str, *details: str) -> None:
        """Log a line, unless there were too many."""
        now = time.monotonic()
        if now - self._lines_since > LINES_S:
            self._lines_since, self._lines = now, 0
        self._lines += 1
        if self._lines <= MOST_LINES:
            _log.log(level, line, *details)
        elif self._lines == MOST_LINES + 1:
            _log.warning("members come and go too fast to log each; the next %.0f s pass in silence", LINES_S)


def _member_of(key: str) -> Member | None:
    """Return the process that a token belongs to; None when the key is not one of ours."""
    role, name, host, number = key.split("/")[-_PARTS:]
    if role not in MOST_LIVE or not all(NAME_PATTERN.fullmatch(part) for part in (name, host)):
        return None
    if not _INCARNATION.fullmatch(number) or int(number) > MAX_INT:
        return None
    return Member(role, name, host, int(number))
