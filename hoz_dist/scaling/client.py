"""What actors and relays do with the node above them: push and fetch, again and again until it worked."""

import random
from collections.abc import Generator
from typing import Any, Final

import simpy

from hoz_dist.scaling.node import Answer, Node, Push
from hoz_dist.scaling.sharing import Shared
from hoz_dist.waiting import FIRST_PAUSE_S, FIRST_TRY_S, LONGER_TRIES, LONGEST_PAUSE_S

MOST_STEPS: Final = 4
"""A fetch of many questions is simulated as so many, each of several."""


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

    def push(self, push: Push) -> Generator[simpy.Event, Any, Answer]:
        """Push until it is accepted or refused."""
        node, costs, env = self._node, self._node.costs, self._node.env
        wire = costs.actor_wire * costs.bytes_up / (costs.bytes_up + costs.bytes_down)
        yield self._host.use(costs.push)
        pause, patience = FIRST_PAUSE_S, FIRST_TRY_S
        while True:
            yield self._host.use(wire)
            reply = node.send(push, costs.bytes_up)
            yield reply | env.timeout(patience)
            answer: Answer | None = reply.value if reply.triggered else None
            if answer is None:
                node.counted.resent += push.count
                patience = min(2.0 * patience, LONGER_TRIES * FIRST_TRY_S)
            elif answer.kind != "busy":
                return answer
            yield from self._pause(pause)
            pause = min(2.0 * pause, LONGEST_PAUSE_S)

    def fetch(self) -> Generator[simpy.Event, Any, int]:
        """Fetch the newest parameters; returns their version."""
        node, costs, env = self._node, self._node.costs, self._node.env
        wire = costs.actor_wire * costs.bytes_down / (costs.bytes_up + costs.bytes_down)
        pause = FIRST_PAUSE_S
        while (version := node.begin(self)) is None:
            yield env.timeout(2.0 * node.latency + costs.exchange)
            yield from self._pause(pause)
            pause = min(2.0 * pause, LONGEST_PAUSE_S)
        steps = min(costs.round_trips, MOST_STEPS)
        for _ in range(steps):
            yield env.timeout(costs.round_trips / steps * (2.0 * node.latency + costs.exchange))
            yield from node.serve(costs.bytes_down / steps, 1.0 / steps)
            yield self._host.use((costs.fetch + wire) / steps)
        node.end(self)
        return version

    def _pause(self, longest: float) -> Generator[simpy.Event, Any, None]:
        yield self._node.env.timeout(self._rng.uniform(longest / 2.0, longest))
