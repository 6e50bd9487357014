"""Who takes part in a run and who left, from tokens that come and go in any order and number."""

import threading
from collections import Counter
from types import MappingProxyType
from typing import Final, NamedTuple

ACTOR: Final = "actor"
LEARNER: Final = "learner"
STANDBY: Final = "standby"
MOST_LIVE: Final = MappingProxyType({LEARNER: 16, STANDBY: 16, ACTOR: 1024})
"""Tokens of each role that are watched. Invented ones cannot fill the memory, make the status too long to travel, or,
being counted by role, hide the leader."""
MOST_OF_NAME: Final = 8
"""Tokens of one role and name that are watched: keys bind an actor to its name, so it cannot crowd out the others."""
MOST_LEFT: Final = 64
"""Processes that left and are remembered."""


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

    def is_namesake_of(self, other: "Member") -> bool:
        """Tell whether two tokens are of processes that take turns: an actor is its name, and so is a learner."""
        return self.id == other.id and (self.role == ACTOR) == (other.role == ACTOR)

    def is_process_of(self, other: "Member") -> bool:
        """Tell whether two tokens are of one process; a learner changes its role."""
        return self.is_namesake_of(other) and self.incarnation == other.incarnation


class Departure(NamedTuple):
    """A process that left."""

    member: Member
    time: float
    """When its token went, seconds of the monotonic clock."""


class Roster:
    """Live processes and those that left; may be used from several threads.

    Who left is listed until it comes back: a process of the same name, whatever its host and incarnation, is the same
    one to a user. An actor that was started again before its old token went is not listed at all. Several learners may
    have one name, that of their host: each that left is listed, and each new one takes one off the list.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._live: set[Member] = set()
        self._left: list[Departure] = []
        self._of_role: Counter[str] = Counter()
        self._of_name: Counter[tuple[str, str]] = Counter()

    def live(self) -> tuple[Member, ...]:
        """Return who holds a token now, sorted."""
        with self._lock:
            return tuple(sorted(self._live))

    def left(self) -> tuple[Departure, ...]:
        """Return who held a token and does so no more, the last one first."""
        with self._lock:
            return tuple(reversed(self._left))

    def join(self, member: Member) -> bool:
        """Note a token; False when there are too many already, and this one is not watched."""
        name = member[:2]
        with self._lock:
            if member in self._live:
                return True
            if self._of_role[member.role] >= MOST_LIVE.get(member.role, 0) or self._of_name[name] >= MOST_OF_NAME:
                return False
            if not any(member.is_process_of(other) for other in self._live):
                self._forget_departure(member)
            self._live.add(member)
            self._of_role[member.role] += 1
            self._of_name[name] += 1
            return True

    def leave(self, member: Member, now: float) -> bool:
        """Note that a token went; False when it was not watched."""
        name = member[:2]
        with self._lock:
            if member not in self._live:
                return False
            self._live.remove(member)
            self._of_role[member.role] -= 1
            self._of_name[name] -= 1
            if not self._of_name[name]:
                del self._of_name[name]
            same = member.is_namesake_of if member.role == ACTOR else member.is_process_of
            if not any(same(other) for other in self._live):
                self._left = [*self._left, Departure(member, now)][-MOST_LEFT:]
            return True

    def _forget_departure(self, member: Member) -> None:
        """Take who came back off the list: the process itself if it is there, else the oldest of its name."""
        same = [one for one in self._left if member.is_process_of(one.member)]
        back = same or [one for one in self._left if member.is_namesake_of(one.member)]
        if back:
            self._left.remove(back[0])
