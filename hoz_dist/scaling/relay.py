"""A relay: hands the newest parameters on to its actors, and pushes the sum of what they pushed meanwhile."""

import random
from collections.abc import Generator
from typing import Any, Final

import simpy

from hoz_dist.scaling.client import Client
from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.node import Answer, Counted, Node, Place, Push
from hoz_dist.scaling.sharing import Process

SUMMING: Final = 3.0 / 7.0
"""Adding a vector to another one passes 3 times over memory of the parameters' size; Adam reads 4 and writes 3."""


class Relay(Node):
    """A relay below a node; it has one push under way at a time.

    The learner makes one step of the sum, whose norm is bounded (`RunConfig.gradient_norm`): a run with relays makes
    fewer updates of as many frames, which the model counts apart, and learns otherwise, which it does not know.

    Args:
        above: The node that it pushes to.
        place: Where it runs, with the link to its actors.
        costs: Of one update, and of serving all parameters.
        clients: Number of its actors.
        counted: Where to count what becomes of the actors' updates.
        rng: Source of the pauses.
    """

    def __init__(
        self, above: Node, place: Place, costs: Costs, *, clients: int, counted: Counted, rng: random.Random
    ) -> None:
        super().__init__(place, costs, clients=clients, counted=counted)
        self._client = Client(above, place.host, rng)
        self._sum: Push | None = None
        self._came = self.env.event()
        self.env.process(self._forward())

    def handle(self, push: Push) -> Generator[simpy.Event, Any, Answer]:
        """Add a push to those that wait to be sent on."""
        yield from self._compute(self.main, SUMMING * self.costs.apply)
        self._sum = _added(self._sum, push)
        if not self._came.triggered:
            self._came.succeed()
        return Answer("accepted", self.version)

    def _forward(self) -> Process:
        """Push sums, and fetch the parameters that come of them."""
        while True:
            yield self._came
            self._came = self.env.event()
            push, self._sum = self._sum, None
            assert push is not None  # noqa: S101 - one came
            yield from self._client.push(push)
            version = yield from self._client.fetch()
            yield from self._publish()
            self.version = version


def _added(one: Push | None, other: Push) -> Push:
    if one is None:
        return Push(other.version, other.made_at, other.frames, other.count)
    count = one.count + other.count
    made_at = (one.count * one.made_at + other.count * other.made_at) / count
    return Push(min(one.version, other.version), made_at, one.frames + other.frames, count)
