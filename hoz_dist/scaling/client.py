"""What actors and relays do with the node above them: push and fetch, again and again until it worked."""

import random
from collections.abc import Generator
from typing import Any, Final

import simpy

from hoz_dist.scaling.links import Connection
from hoz_dist.scaling.node import Answer, Node, Push
from hoz_dist.scaling.sharing import Process, Shared
from hoz_dist.waiting import FIRST_PAUSE_S, LONGEST_PAUSE_S, Patience

# As in the code; a test compares them.
UNDER_WAY: Final = 2
"""Questions of a fetch that are under way at once: while one part is taken in, the next is served."""
FAST_S: Final = 0.05
"""When a question takes longer, they are asked one by one."""

MOST_STEPS: Final = 4
"""A fetch of many questions after each other is simulated as so many, each of several."""


class Client:
    """One that pushes and fetches.

    Args:
        node: The node above.
        host: Its own cores.
        rng: Source of the pauses.
    """

    def __init__(self, node: Node, host: Shared, rng: random.Random) -> None:
        self._node = node
        self._host = host
        self._rng = rng
        self._connection = Connection(node.env, node.link)
        self._patience = Patience()
        self._thread = simpy.Resource(node.env)
        """Takes parameters in."""

    def push(self, push: Push) -> Generator[simpy.Event, Any, Answer]:
        """Push until it is accepted or refused."""
        node, env, patience = self._node, self._node.env, self._patience
        yield self._host.use(node.costs.push)
        pause = FIRST_PAUSE_S
        while True:
            self._host.use(node.costs.up_share * node.costs.actor_wire)  # by other threads, while this one waits
            asked, reply = env.now, node.send(push, self._connection)
            yield reply | env.timeout(patience.seconds)
            answer: Answer | None = reply.value if reply.triggered else None
            if answer is None:
                patience.timed_out()
                node.resent += 1
            else:
                patience.answered(env.now - asked)
                if answer.kind != "busy":
                    return answer
            yield from self._pause(pause)
            pause = min(2.0 * pause, LONGEST_PAUSE_S)

    def fetch(self) -> Generator[simpy.Event, Any, int]:
        """Fetch the newest parameters; returns their version."""
        node, costs, env = self._node, self._node.costs, self._node.env
        pause = FIRST_PAUSE_S
        while (version := node.begin(self)) is None:
            yield env.timeout(2.0 * node.latency + costs.exchange)
            yield from self._pause(pause)
            pause = min(2.0 * pause, LONGEST_PAUSE_S)
        self._host.use((1.0 - costs.up_share) * costs.actor_wire)
        asked, part = env.now, 1.0 / costs.questions
        yield from self._read(1, part)
        if (left := costs.questions - 1) > 0:
            lanes = min(left, UNDER_WAY) if env.now - asked < FAST_S else 1
            yield env.all_of([env.process(self._read(left / lanes, part)) for _ in range(lanes)])
        node.end(self)
        return version

    def _read(self, questions: float, part: float) -> Process:
        """Ask some questions one after the other, each for a part of the parameters."""
        node, costs, env = self._node, self._node.costs, self._node.env
        steps = min(round(questions) or 1, MOST_STEPS)
        share = part * questions / steps
        for _ in range(steps):
            yield env.timeout(questions / steps * (2.0 * node.latency + costs.exchange))
            yield from node.serve(share, self._connection)
            with self._thread.request() as turn:
                yield turn
                yield self._host.use(share * costs.fetch)

    def _pause(self, longest: float) -> Generator[simpy.Event, Any, None]:
        yield self._node.env.timeout(self._rng.uniform(longest / 2.0, longest))
