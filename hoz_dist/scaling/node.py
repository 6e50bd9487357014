"""A process that takes pushes and serves parameters, as a learner does: threads, inbox, versions, one interpreter lock.

What it does with a push is another's to say; see `hoz_dist.scaling.learner` and `hoz_dist.scaling.relay`.
"""

from collections import Counter
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import simpy

from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.links import Connection, Link
from hoz_dist.scaling.sharing import Process, Shared, call

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


class Request(NamedTuple):
    """A push on its way, and who waits for the answer."""

    push: Push
    reply: simpy.Event


@dataclass
class Thread:
    """A Python thread of a node."""

    worked: float = 0.0
    """Seconds in which it got on, or wanted a core; without those in which it waited for the interpreter lock."""
    waited: float = 0.0
    """Seconds in which it waited for that."""


@dataclass
class Counted:
    """What became of the actors' updates so far."""

    frames: float = 0.0
    """Of those that were applied."""
    applied: int = 0
    stale: int = 0
    """Those that were refused."""
    answered: int = 0
    """Those that somebody answered for good: the learner, or a relay."""
    lags: float = 0.0
    """Sum over those that were applied, versions."""
    ages: float = 0.0
    """The same, seconds."""
    lag_max: int = 0


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
        counted: Where to count what becomes of the actors' updates.

    Attributes:
        version: Of the newest parameters.
        main: The main thread, which handles pushes.
        receiver: The thread that receives pushes.
        server: The thread that serves parameters.
        lock_used: Seconds in which the interpreter lock was held.
        settled: Pushes that it took or refused.
        busy: Pushes that it told to come again.
        resent: Pushes that came again because no answer came in time.
    """

    def __init__(self, place: Place, costs: Costs, *, clients: int, counted: Counted) -> None:
        self.env, self.host, self.link, self.latency = place
        self.costs = costs
        self.counted = counted
        self._clients = clients
        self.version = self.settled = self.busy = self.resent = 0
        self.main, self.receiver, self.server = Thread(), Thread(), Thread()
        self.lock_used = 0.0
        self._lock = simpy.Resource(self.env)
        self._channel = simpy.Store(self.env)
        self._inbox = simpy.Store(self.env)
        self._serving = simpy.Resource(self.env)
        self._reading: dict[object, int] = {}
        """Version that each reader is at."""
        self._readers: Counter[int] = Counter()
        """How many are at each version."""
        self.env.process(self._receive())
        self.env.process(self._work())

    # --- what clients call ---

    def send(self, push: Push, connection: Connection) -> simpy.Event:
        """Send a push; returns the event of its answer."""
        request = Request(push, self.env.event())
        self.env.process(self._carry(request, connection))
        return request.reply

    def begin(self, reader: object) -> int | None:
        """Begin to read the newest version; None when no more can be kept."""
        versions = len(self._readers) + (self.version not in self._readers)
        full = len(self._reading) >= MOST_READERS or versions * self.costs.bytes_down > MOST_VERSION_BYTES
        if full and self._reading:
            return None
        self._reading[reader] = self.version
        self._readers[self.version] += 1
        return self.version

    def serve(self, share: float, connection: Connection) -> Process:
        """Answer a reader with a share of the parameters."""
        with self._serving.request() as turn:
            yield turn
            yield from self._compute(self.server, self.costs.serve, share)
        self.host.use(share * (1.0 - self.costs.up_share) * self.costs.learner_wire)  # by other threads; nobody waits
        yield from connection.down(share * self.costs.bytes_down)

    def end(self, reader: object) -> None:
        """End to read."""
        version = self._reading.pop(reader)
        self._readers[version] -= 1
        if not self._readers[version]:
            del self._readers[version]

    # --- what it does ---

    def handle(self, push: Push) -> Generator[simpy.Event, Any, Answer]:
        """Take a push; the main thread's work."""
        raise NotImplementedError

    def _carry(self, request: Request, connection: Connection) -> Process:
        yield from connection.up(self.costs.bytes_up)
        call(self.env, self.latency, self._channel.put, request)

    def _receive(self) -> Process:
        """Check pushes, and let them wait, or tell them to come again."""
        while True:
            request: Request = yield self._channel.get()
            self.host.use(self.costs.up_share * self.costs.learner_wire)  # by other threads
            yield from self._compute(self.receiver, self.costs.receive)
            waiting = len(self._inbox.items)
            if waiting and (waiting >= MOST_WAITING or (waiting + 1) * self.costs.bytes_up > MOST_WAITING_BYTES):
                self._put_off(request)
            else:
                self._inbox.put(request)
                call(self.env, LONGEST_WAIT_S, self._put_off_late, request)

    def _work(self) -> Process:
        """Handle pushes one by one."""
        while True:
            request: Request = yield self._inbox.get()
            if request.push.is_done:
                answer = Answer("accepted", self.version)
            else:
                request.push.is_done = True
                self.settled += 1
                answer = yield from self.handle(request.push)
            self._answer(request, answer)
            yield from self._compute(self.main, self._afterwards)

    def _compute(self, thread: Thread, seconds: float, share: float = 1.0) -> Process:
        """Go through a share of a stage: first with the interpreter lock, then without."""
        held = self.costs.held(seconds)
        if held > 0.0:
            asked = self.env.now
            with self._lock.request() as turn:
                yield turn
                thread.waited += self.env.now - asked
                began = self.env.now
                yield from self._use(thread, share * held)
                self.lock_used += self.env.now - began
        yield from self._use(thread, share * (seconds - held))

    def _use(self, thread: Thread, seconds: float) -> Process:
        """Let a thread compute."""
        began = self.env.now
        yield self.host.use(seconds)
        thread.worked += self.env.now - began

    def _publish(self) -> Process:
        """Make new parameters known."""
        yield from self._compute(self.main, self.costs.publish)
        yield from self._use(self.main, self._clients * self.costs.notify)
        self.host.use(self._clients * self.costs.notify_wire)  # nobody waits for it

    def _put_off_late(self, request: Request) -> None:
        """Tell a push that still waits to come again."""
        if request in self._inbox.items:
            self._inbox.items.remove(request)
            self._put_off(request)

    def _put_off(self, request: Request) -> None:
        self.busy += 1
        self._answer(request, Answer("busy", self.version))

    def _answer(self, request: Request, answer: Answer) -> None:
        call(self.env, self.latency + self.costs.exchange, request.reply.succeed, answer)

    @property
    def _afterwards(self) -> float:
        """Time of the main thread for a push that was answered already."""
        return 0.0
