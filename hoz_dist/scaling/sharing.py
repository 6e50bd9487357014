"""Resources that their users share evenly: the cores of a host, the bandwidth of a link."""

import math
import random
from collections.abc import Callable, Generator
from heapq import heappop, heappush
from typing import Any, Final

import simpy

Process = Generator[simpy.Event, Any, None]
"""What something does in the course of time."""

UNEVEN: Final = 0.5
"""How much more or less than their share some get where it is uneven."""
_ROUNDING: Final = 1e-12
"""Relative error of times that are added up; work that is this near its end is done."""


class Shared:
    """A resource of some units on which users share time in turns so short that all get on evenly.

    One user gets on at the speed of one unit at most: a thread on a host with many cores, a flow whose sender's link is
    slower than the receiver's. More users than units are slowed down alike. Round-robin scheduling is this, as its time
    slices become short.

    Args:
        env: Simulation.
        units: How many users go at full speed; need not be whole. Infinitely many: one for each user.
        uneven: Source of luck, for users that do not share exactly evenly, as flows of TCP: those that come at the same
            moment would otherwise be done at the same moment, and stay in step for ever. None for exact shares.
        crowding: Share by which work takes longer while all units are in use, if they are not infinitely many; cores
            share caches and memory.
        switching: Share by which work takes longer still while there are more users than units, if they are not
            infinitely many; processes that take turns on a core find its caches cold.
    """

    def __init__(
        self,
        env: simpy.Environment,
        units: float = math.inf,
        uneven: random.Random | None = None,
        crowding: float = 0.0,
        switching: float = 0.0,
    ) -> None:
        self._env = env
        self.units = units
        self._crowding = crowding
        self._switching = switching
        self._uneven = uneven
        self._users: list[tuple[float, int, simpy.Event]] = []
        """What each one's progress must reach, its number, and what happens then."""
        self._number = 0
        self._progress = 0.0
        """Work that a user would have done that was here from the beginning."""
        self._since = env.now
        self._used = 0.0
        self._turn = 0

    def use(self, work: float) -> simpy.Event:
        """Return the event that a user's work is done.

        Args:
            work: Seconds that it takes on a unit of its own.
        """
        if math.isinf(self.units):
            self._used += work
            return self._env.timeout(work)
        self._get_on()
        if self._uneven is not None and self._users:
            work *= self._uneven.uniform(1.0 - UNEVEN, 1.0 + UNEVEN)
        event = self._env.event()
        self._number += 1
        heappush(self._users, (self._progress + work, self._number, event))
        self._plan()
        return event

    def used(self) -> float:
        """Return the seconds of all units together that were in use so far."""
        self._get_on()
        return self._used

    def _speed(self) -> float:
        """Return how fast each user gets on."""
        users = len(self._users)
        crowd = min(users - 1, self.units - 1) / (self.units - 1) if self.units > 1 else 0.0
        slower = 1.0 + self._crowding * crowd
        if users > self.units:
            slower *= 1.0 + self._switching
        return min(1.0, self.units / users) / slower

    def _get_on(self) -> None:
        """Account for the time since the last change."""
        now = self._env.now
        if self._users:
            self._progress += (now - self._since) * self._speed()
            self._used += (now - self._since) * min(self.units, len(self._users))
        self._since = now

    def _plan(self) -> None:
        """Wake up when the next user will be done, if nothing changes before."""
        if not self._users:
            return
        self._turn += 1
        delay = max(self._users[0][0] - self._progress, 0.0) / self._speed()
        call(self._env, delay, self._done, self._turn)

    def _done(self, turn: int) -> None:
        if turn != self._turn:
            return  # something changed before
        self._get_on()
        done = self._users[0][0]  # whose end this is, whatever the rounding
        self._progress = max(self._progress, done)
        while self._users and self._users[0][0] <= self._progress * (1.0 + _ROUNDING):
            heappop(self._users)[2].succeed()
        self._plan()


def call(env: simpy.Environment, delay: float, function: Callable[..., object], *arguments: Any) -> None:
    """Call a function after a while."""
    event = env.timeout(delay)
    assert event.callbacks is not None  # noqa: S101 - only an event that has happened has none

    def happened(_: simpy.Event) -> None:
        function(*arguments)

    event.callbacks.append(happened)
