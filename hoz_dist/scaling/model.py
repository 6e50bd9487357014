"""Puts a run together from its parts, lets it run until it is under way, and measures it."""

import math
import random
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Final

import simpy

from hoz_dist.errors import InvalidValueError
from hoz_dist.scaling.client import Client
from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.learner import Learner
from hoz_dist.scaling.node import Counted, Link, Node, Place, Process, Push
from hoz_dist.scaling.relay import Relay
from hoz_dist.scaling.setting import Prediction, Setting
from hoz_dist.scaling.sharing import Shared

LEAST_UPDATES: Final = 200
"""Actors' updates over which is measured, at least."""
UPDATES_PER_ACTOR: Final = 3
"""The same, for each actor."""
WARM_UP: Final = 0.5
"""Updates before, as a share of those that are measured; the first of an actor is not like the others."""
LONGEST_S: Final = 3600.0
"""Simulated time after which nothing is waited for any more: the run does not get on."""
_PROGRESS_EVERY: Final = 500
_TINY: Final = 1e-9

Told = Callable[[float], None]
"""Told which share of the work is done."""


def simulate(costs: Costs, setting: Setting, seed: int = 0, progress: Told | None = None) -> Prediction:
    """Predict what a run does once it is under way.

    Args:
        costs: What an update costs.
        setting: Machines, links and processes.
        seed: Of the pauses and of the moments at which actors begin; one seed, one result.
        progress: Told how far the work is.
    """
    return _Run(costs, setting, seed, progress).measure()


@dataclass(frozen=True)
class _Moment:
    """All counters at one time."""

    now: float
    counted: Counted
    sent: int
    """Pushes that were sent to the learner."""
    actors: float
    """Seconds of the actors' cores."""
    used: dict[str, float]
    """Seconds in which each of the learner's resources was fully used."""
    relays: list[dict[str, float]]
    """The same, of a relay of each level."""


class _Run:
    """A run.

    Learners that share the parameters do the same at the same time, so one stands for all.
    """

    def __init__(self, costs: Costs, setting: Setting, seed: int, progress: Told | None) -> None:
        if costs.learn_from == "rollouts" and (setting.shards > 1 or setting.fan_out is not None):
            message = "Rollouts have no parts that learners could share, nor a sum: shards and relays need gradients."
            raise InvalidValueError(message)
        self._costs, self._setting, self._progress = costs, setting, progress
        self._rng = random.Random(seed)
        self._env = env = simpy.Environment()
        self._counted = Counted()
        self._goal, self._until = env.event(), 0
        self._host = Shared(env, setting.cores, costs.crowding)
        # All cores of the actors' hosts work, as those of this host do with two actors.
        self._actors = self._host if setting.one_host else Shared(env, math.inf, costs.crowding)
        self._latency = 0.0 if setting.one_host else setting.latency
        levels = setting.relays
        between = setting.hub_bandwidth if levels else setting.bandwidth
        self._learner = Learner(
            Place(env, self._host, self._make_link(between / setting.shards), self._latency),
            costs.part(setting.shards),
            clients=(*levels, setting.actors)[0],
            counted=self._counted,
            max_lag=setting.max_lag,
        )
        self._samples: list[Node] = []
        """A relay of each level."""
        above: list[Node] = [self._learner]
        for relays, below in zip(levels, (*levels, setting.actors)[1:], strict=True):
            flow = setting.bandwidth if below == setting.actors else setting.hub_bandwidth
            above = [self._make_relay(above[n % len(above)], flow, below // relays) for n in range(relays)]
            self._samples.append(above[0])
        for number in range(setting.actors):
            env.process(self._actor(above[number % len(above)]))

    def measure(self) -> Prediction:
        """Let it get under way, and measure it."""
        updates = max(LEAST_UPDATES, UPDATES_PER_ACTOR * self._setting.actors)
        before = int(WARM_UP * updates)
        self._run_until(before, before + updates, LONGEST_S / 2)
        start, self._counted.lag_max = self._moment(), 0
        self._run_until(before + updates, before + updates, LONGEST_S)
        return self._prediction(start, self._moment())

    def _run_until(self, pushed: int, last: int, longest: float) -> None:
        """Run until so many updates have been answered for good, or it is so late, seconds."""
        self._until = pushed
        while self._counted.pushed < pushed and self._env.now < longest:
            self._goal = self._env.event()
            self._env.run(self._goal | self._env.timeout(longest - self._env.now))
            if self._progress is not None:
                self._progress(self._counted.pushed / last)

    def _actor(self, above: Node) -> Process:
        """Fetch, roll out, push, again and again."""
        costs, env, host = self._costs, self._env, self._actors
        client = Client(above, host, self._rng)
        work = costs.load + costs.act + costs.differentiate
        yield env.timeout(self._rng.uniform(0.0, work))
        version = yield from client.fetch()
        ahead: simpy.Process | None = None
        while True:
            push = Push(version, env.now, costs.frames)
            yield host.use(work)
            if costs.learn_from == "rollouts":  # the next is acted while the learner learns from this one
                if ahead is not None:
                    yield ahead
                version = yield from client.fetch()
                ahead = env.process(self._push(client, push))
                continue
            yield from self._push(client, push)
            if version != above.version:  # a relay may have nothing newer
                version = yield from client.fetch()

    def _push(self, client: Client, push: Push) -> Process:
        yield from client.push(push)
        self._counted.pushed += 1
        if self._counted.pushed >= self._until or self._counted.pushed % _PROGRESS_EVERY == 0:
            self._answered()

    def _answered(self) -> None:
        if not self._goal.triggered:
            self._goal.succeed()

    def _make_link(self, flow: float) -> Link:
        bandwidth = math.inf if self._setting.one_host else self._setting.hub_bandwidth
        return Link(self._env, bandwidth, flow, self._rng)

    def _make_relay(self, above: Node, flow: float, clients: int) -> Node:
        host = Shared(self._env, self._setting.cores, self._costs.crowding)
        place = Place(self._env, host, self._make_link(flow), self._latency)
        return Relay(above, place, self._costs, clients=clients, counted=self._counted, rng=self._rng)

    def _moment(self) -> _Moment:
        return _Moment(
            self._env.now,
            replace(self._counted),
            self._learner.sent,
            self._actors.used(),
            self._used_by(self._learner) | {"host": self._host.used() / self._setting.cores},
            [self._used_by(relay) for relay in self._samples],
        )

    @staticmethod
    def _used_by(node: Node) -> dict[str, float]:
        """Return the seconds in which each resource was fully used."""
        link = node.link
        return {
            "apply": node.main_used,
            "receive": node.receive_used,
            "serve": node.serve_used,
            "gil": node.lock_used,
            "up": link.up.used() / link.up.units if math.isfinite(link.up.units) else 0.0,
            "down": link.down.used() / link.down.units if math.isfinite(link.down.units) else 0.0,
        }

    def _prediction(self, start: _Moment, end: _Moment) -> Prediction:
        seconds = max(end.now - start.now, _TINY)
        count = {name: value - getattr(start.counted, name) for name, value in asdict(end.counted).items()}
        applied, pushed = max(count["applied"], 1), max(count["pushed"], 1)
        loads = {f"{name}_load": (used - start.used[name]) / seconds for name, used in end.used.items()}
        relays = [
            (used - before[name]) / seconds
            for before, after in zip(start.relays, end.relays, strict=True)
            for name, used in after.items()
        ]
        part = self._learner.costs
        cores = self._setting.cores if self._setting.one_host else self._setting.actors
        return Prediction(
            actors=self._setting.actors,
            frames_per_second=count["frames"] / seconds,
            updates_per_second=count["updates"] / seconds,
            lag=count["lags"] / applied,
            lag_max=self._counted.lag_max,
            age=count["ages"] / applied,
            stale=count["stale"] / max(count["stale"] + count["applied"], 1),
            busy=count["busy"] / pushed,
            resent=count["resent"] / pushed,
            actor_load=(end.actors - start.actors) / seconds / cores,
            relay_load=max(relays, default=None),
            megabits_up=8e-6 * (end.sent - start.sent) * part.bytes_up / seconds,
            megabits_down=8e-6 * count["fetched"] * part.bytes_down / seconds,
            simulated_seconds=seconds,
            **loads,
        )
