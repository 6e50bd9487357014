"""What actors and relays do with the node above them: push and fetch, again and again until it worked."""

import random
from collections.abc import Generator
from typing import Any, Final

import simpy

from hoz_dist.scaling.node import Answer, Node, Process, Push
from hoz_dist.scaling.sharing import Shared
from hoz_dist.waiting import FIRST_PAUSE_S, FIRST_TRY_S, LONGER_TRIES, LONGEST_PAUSE_S

UNDER_WAY: Final = 2
"""Questions of a fetch that are under way at once: while one part is taken in, the next is served."""
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
        self._thread = simpy.Resource(node.env)
        """Takes parameters in."""

    def push(self, push: Push) -> Generator[simpy.Event, Any, Answer]:
        """Push until it is accepted or refused."""
        node, costs, env = self._node, self._node.costs, self._node.env
        wire = costs.actor_wire * costs.bytes_up / (costs.bytes_up + costs.bytes_down)
        yield self._host.use(costs.push)
        pause, patience = FIRST_PAUSE_S, FIRST_TRY_S
        while True:
            self._host.use(wire)  # by other threads, while this one goes on to wait
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
        pause = FIRST_PAUSE_S
        while (version := node.begin(self)) is None:
            yield env.timeout(2.0 * node.latency + costs.exchange)
            yield from self._pause(pause)
            pause = min(2.0 * pause, LONGEST_PAUSE_S)
        self._host.use(costs.actor_wire * costs.bytes_down / (costs.bytes_up + costs.bytes_down))
        lanes = UNDER_WAY if costs.round_trips > 1 else 1
        yield env.all_of([env.process(self._read(lanes)) for _ in range(lanes)])
        node.end(self)
        return version

    def _read(self, lanes: int) -> Process:
        """Ask for a share of the parameters, part by part."""
        node, costs, env = self._node, self._node.costs, self._node.env
        steps = min(costs.round_trips, MOST_STEPS)
        share = 1.0 / (steps * lanes)
        for _ in range(steps):
            yield env.timeout(costs.round_trips / steps * (2.0 * node.latency + costs.exchange))
            yield from node.serve(share)
            with self._thread.request() as turn:
                yield turn
                yield self._host.use(share * costs.fetch)

    def _pause(self, longest: float) -> Generator[simpy.Event, Any, None]:
        yield self._node.env.timeout(self._rng.uniform(longest / 2.0, longest))
