"""The learner: applies what is pushed, if it is not too stale."""

from collections.abc import Generator
from typing import Any

import simpy

from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.node import Answer, Counted, Node, Place, Push


class Learner(Node):
    """One learner; of several that share the parameters, one that stands for all: they do the same at the same time.

    Args:
        place: Where it runs.
        costs: What its stages take.
        clients: How many processes are told of new parameters.
        counted: Where to count what becomes of the actors' updates.
        most_lag: Largest policy lag of a push that is applied, versions.
    """

    def __init__(self, place: Place, costs: Costs, *, clients: int, counted: Counted, most_lag: int) -> None:
        super().__init__(place, costs, clients=clients, counted=counted)
        self._most_lag = most_lag

    def handle(self, push: Push) -> Generator[simpy.Event, Any, Answer]:
        """Refuse a push that is stale; apply the others, and publish the parameters."""
        counted, lag = self.counted, self.version - push.version
        if lag > self._most_lag:
            yield from self._compute(self.main, self.costs.fixed)
            counted.stale += push.count
            return Answer("stale", self.version)
        yield from self._compute(self.main, self.costs.apply)
        yield from self._publish()
        self.version += 1
        counted.frames += push.frames
        counted.applied += push.count
        counted.lags += push.count * lag
        counted.ages += push.count * (self.env.now - push.made_at)
        counted.lag_max = max(counted.lag_max, lag)
        return Answer("accepted", self.version)

    @property
    def _afterwards(self) -> float:
        """Time for records and checkpoints."""
        return self.costs.record
