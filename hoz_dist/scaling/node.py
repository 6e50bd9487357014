"""A process that takes pushes and serves parameters, as a learner does: threads, inbox, versions, one interpreter lock.

What it does with a push is another's to say; see `hoz_dist.scaling.learner` and `hoz_dist.scaling.relay`.
"""

import math
import random
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import simpy

from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.sharing import Shared, call

Process = Generator[simpy.Event, Any, None]
"""What a part of a process does in the course of time."""

# As in the code; a test compares them.
MOST_WAITING: Final = 32
MOST_WAITING_BYTES: Final = 256 * 1024 * 1024
LONGEST_WAIT_S: Final = 5.0
MOST_READERS: Final = 1024
MOST_VERSION_BYTES: Final = 512 * 1024 * 1024


@dataclass(eq=False)
class Push:
    """A gradient, or rollout, that an actor or a relay pushes."""

    version: int
    """Of the parameters that it was computed on; the oldest, if it is a sum."""
    made_at: float
    """When those parameters had been fetched; of a sum the mean."""
    frames: float
    count: int = 1
    """Of how many actors' updates it is the sum."""
    is_done: bool = False
    """Whether it was taken; should it come again, it only is answered."""


class Answer(NamedTuple):
    """What the sender of a push hears."""

    kind: str
    """``accepted``, ``busy`` or ``stale``."""
    version: int


@dataclass(eq=False)
class Request:
    """A push on its way, and who waits for the answer."""

    push: Push
    reply: simpy.Event
    arrived: float = 0.0


class Link:
    """A host's link: each way shared by what goes that way.

    Args:
        env: Simulation.
        bandwidth: Bits/s; infinitely many for a loopback, whose cost is Zenoh's CPU time alone.
        flow: Bits/s at which one message travels at most, because the other end's link is no faster.
        rng: Source of the luck with which messages share it.
    """

    def __init__(self, env: simpy.Environment, bandwidth: float, flow: float, rng: random.Random) -> None:
        units = math.inf if math.isinf(bandwidth) else bandwidth / flow
        self.up, self.down = Shared(env, units, uneven=rng), Shared(env, units, uneven=rng)
        self._flow = flow

    def seconds(self, size: float) -> float:
        """Return how long a message of some bytes takes when nothing else is under way."""
        return 8.0 * size / self._flow


@dataclass
class Counted:
    """What happened so far."""

    frames: float = 0.0
    updates: int = 0
    lags: float = 0.0
    """Sum over the actors' updates that were applied."""
    ages: float = 0.0
    applied: int = 0
    """Actors' updates that were applied."""
    stale: int = 0
    """Actors' updates that were refused."""
    busy: int = 0
    resent: int = 0
    pushed: int = 0
    """Actors' updates that were answered for good."""
    lag_max: int = 0
    fetched: int = 0
    """Times that the learner served all parameters."""


class Place(NamedTuple):
    """Where a node runs."""

    env: simpy.Environment
    host: Shared
    """Its cores."""
    link: Link
    latency: float
    """Of a message, one way, seconds."""


class Node:
    """What learners and relays have in common.

    Args:
        place: Where it runs.
        costs: What its stages take.
        clients: How many processes are told of new parameters.
        counted: Where to count.

    Attributes:
        version: Of the newest parameters.
        main_used: Seconds in which the main thread had work.
        receive_used: The same of the thread that receives pushes.
        serve_used: The same of the thread that serves parameters.
        lock_used: Seconds in which the interpreter lock was held.
        sent: Pushes that were sent to it.
    """

    def __init__(self, place: Place, costs: Costs, *, clients: int, counted: Counted) -> None:
        self.env, self.host, self.link, self.latency = place
        self.costs = costs
        self.counted = counted
        self._clients = clients
        self.version = self.sent = 0
        self.main_used = self.receive_used = self.serve_used = self.lock_used = 0.0
        self._lock = simpy.Resource(self.env)
        self._channel = simpy.Store(self.env)
        self._inbox = simpy.Store(self.env)
        self._serving = simpy.Resource(self.env)
        self._reading: dict[object, int] = {}
        """Version that each reader is at."""
        self.env.process(self._receive())
        self.env.process(self._work())

    # --- what clients call ---

    def send(self, push: Push, size: float) -> simpy.Event:
        """Send a push; returns the event of its answer."""
        self.sent += 1
        request = Request(push, self.env.event())
        sent = self.link.up.use(self.link.seconds(size))
        assert sent.callbacks is not None  # noqa: S101 - it has not happened yet
        sent.callbacks.append(lambda _: call(self.env, self.latency, self._channel.put, request))
        return request.reply

    def begin(self, reader: object) -> int | None:
        """Begin to read the newest version; None when no more can be kept."""
        versions = {*self._reading.values(), self.version}
        full = len(self._reading) >= MOST_READERS or len(versions) * 4 * self.costs.parameters > MOST_VERSION_BYTES
        if full and len(self._reading) > 0:
            return None
        self._reading[reader] = self.version
        return self.version

    def serve(self, share: float) -> Process:
        """Answer a reader with a share of the parameters."""
        with self._serving.request() as turn:
            yield turn
            began = self.env.now
            yield from self._compute(share * self.costs.serve)
            self.serve_used += self.env.now - began
        self.host.use(share * self._wire_down)  # by other threads; nobody waits for all of it
        yield self.link.down.use(self.link.seconds(share * self.costs.bytes_down))

    def end(self, reader: object) -> None:
        """End to read."""
        self._reading.pop(reader, None)

    # --- what it does ---

    def handle(self, push: Push) -> Generator[simpy.Event, Any, Answer]:
        """Take a push; the main thread's work."""
        raise NotImplementedError

    def _receive(self) -> Process:
        """Check pushes, and let them wait, or tell them to come again."""
        while True:
            request: Request = yield self._channel.get()
            began = self.env.now
            self.host.use(self._wire_up)  # by other threads
            yield from self._compute(self.costs.receive)
            self.receive_used += self.env.now - began
            waiting = len(self._inbox.items)
            if waiting and (waiting >= MOST_WAITING or (waiting + 1) * self.costs.bytes_up > MOST_WAITING_BYTES):
                self._put_off(request)
            else:
                request.arrived = self.env.now
                self._inbox.put(request)

    def _work(self) -> Process:
        """Handle pushes one by one."""
        while True:
            request: Request = yield self._inbox.get()
            if self.env.now - request.arrived > LONGEST_WAIT_S:
                self._put_off(request)
                continue
            began = self.env.now
            if request.push.is_done:
                answer = Answer("accepted", self.version)
            else:
                request.push.is_done = True
                answer = yield from self.handle(request.push)
            self._answer(request, answer)
            yield from self._compute(self._afterwards)
            self.main_used += self.env.now - began

    def _compute(self, seconds: float) -> Process:
        """Work in a Python thread: a share of the time with the interpreter lock."""
        held = seconds * self.costs.gil
        if held > 0.0:
            with self._lock.request() as turn:
                yield turn
                began = self.env.now
                yield self.host.use(held)
                self.lock_used += self.env.now - began
        yield self.host.use(seconds - held)

    def _publish(self) -> Process:
        """Make new parameters known."""
        yield from self._compute(self.costs.publish)
        yield self.host.use(self._clients * self.costs.notify)
        self.host.use(self._clients * self.costs.notify_wire)  # nobody waits for it

    def _put_off(self, request: Request) -> None:
        self.counted.busy += 1
        self._answer(request, Answer("busy", self.version))

    def _answer(self, request: Request, answer: Answer) -> None:
        call(self.env, self.latency + self.costs.exchange, request.reply.succeed, answer)

    @property
    def _afterwards(self) -> float:
        """Time of the main thread for a push that was answered already."""
        return 0.0

    @property
    def _wire_up(self) -> float:
        """Zenoh's time for a push."""
        return self.costs.learner_wire * self.costs.bytes_up / (self.costs.bytes_up + self.costs.bytes_down)

    @property
    def _wire_down(self) -> float:
        """Zenoh's time for all parameters."""
        return self.costs.learner_wire - self._wire_up
