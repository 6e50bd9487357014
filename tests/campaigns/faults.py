"""Faults at random: processes killed without warning, and processes that stand still for a while and go on."""

import random
import threading
import time
from collections.abc import Sequence
from typing import Final, Literal, NamedTuple

from tests.campaigns.supervisor import Supervisor

PAUSE_S: Final = 6.0
"""How long a process stands still; longer than every lease."""

Kind = Literal["kill", "pause"]


class Fault(NamedTuple):
    """What was done to a process."""

    name: str
    """Name of the program."""
    kind: Kind
    began: float
    """When, seconds since 1970."""
    ended: float
    """When a process that was paused goes on; for a killed one the same as ``began``."""


class Blow(NamedTuple):
    """A fault that is planned."""

    after: float
    """Seconds from the beginning."""
    kind: Kind
    name: str


def plan(rng: random.Random, names: Sequence[str], seconds: float, count: int) -> list[Blow]:
    """Plan faults at random times, of random kinds, for random programs."""
    return [
        Blow(after, rng.choice(("kill", "pause")), rng.choice(names))
        for after in sorted(rng.uniform(0.0, seconds) for _ in range(count))
    ]


def strike(supervisor: Supervisor, name: str, kind: Kind, pause_s: float = PAUSE_S) -> Fault | None:
    """Do it; None when the process does not run just now, or stands still already."""
    if kind == "kill":
        began = supervisor.kill(name)
        return None if began is None else Fault(name, kind, began, began)
    began = supervisor.pause(name, pause_s)
    return None if began is None else Fault(name, kind, began, began + pause_s)


def carry_out(supervisor: Supervisor, blows: Sequence[Blow], names: Sequence[str], pause_s: float) -> list[Fault]:
    """Carry out a plan; a process that is down already is spared, and the next one has it instead."""
    clock, start, faults = threading.Event(), time.monotonic(), list[Fault]()
    for blow in blows:
        clock.wait(max(start + blow.after - time.monotonic(), 0.0))
        first = names.index(blow.name)
        for name in (*names[first:], *names[:first]):
            fault = strike(supervisor, name, blow.kind, pause_s)
            if fault is not None:
                faults.append(fault)
                break
    return faults
