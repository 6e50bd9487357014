"""Links between hosts: bandwidth that messages share, and connections on which they follow each other."""

import math
import random
from typing import NamedTuple

import simpy

from hoz_dist.scaling.sharing import Process, Shared


class Way:
    """One direction of a host's link, shared by what goes that way.

    Args:
        env: Simulation.
        bandwidth: Bits/s; infinite on one host, where messages take no time but that of the processors.
        flow: Bits/s at which one connection gets on at most, because the other end's link is no faster.
        rng: Source of the luck with which connections share it.

    Attributes:
        bits: That have been carried.
    """

    def __init__(self, env: simpy.Environment, bandwidth: float, flow: float, rng: random.Random) -> None:
        self._flow = flow
        self._shared = Shared(env, bandwidth / flow, rng) if math.isfinite(bandwidth) else None
        self.bits = 0.0

    def carry(self, size: float, turn: simpy.Resource) -> Process:
        """Carry a message.

        Args:
            size: Bytes.
            turn: Of its connection: what was sent before is carried before.
        """
        if self._shared is not None:
            with turn.request() as mine:
                yield mine
                yield self._shared.use(8.0 * size / self._flow)
        self.bits += 8.0 * size

    def used(self) -> float:
        """Return the seconds in which all of the bandwidth was in use, or in part as much."""
        return self._shared.used() / self._shared.units if self._shared is not None else 0.0


class Link(NamedTuple):
    """A host's link."""

    up: Way
    """Towards the host."""
    down: Way


class Connection:
    """Of a client and a node; a message follows the one before, each way, also one that nobody waits for any more."""

    def __init__(self, env: simpy.Environment, link: Link) -> None:
        self._link = link
        self._up, self._down = simpy.Resource(env), simpy.Resource(env)

    def up(self, size: float) -> Process:
        """Carry a message of some bytes to the node."""
        return self._link.up.carry(size, self._up)

    def down(self, size: float) -> Process:
        """Carry a message of some bytes to the client."""
        return self._link.down.carry(size, self._down)
