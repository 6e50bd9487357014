"""Puts a run together from its parts, lets it run until it is under way, and measures it."""

import math
import random
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Final

import simpy

from hoz_dist.config import RunConfig
from hoz_dist.errors import InvalidValueError
from hoz_dist.scaling.client import Client
from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.learner import Learner
from hoz_dist.scaling.links import Link, Way
from hoz_dist.scaling.node import Counted, Node, Place, Push
from hoz_dist.scaling.relay import Relay
from hoz_dist.scaling.setting import Prediction, Setting
from hoz_dist.scaling.sharing import Process, Shared

LEAST_UPDATES: Final = 200
"""Actors' updates over which is measured, at least."""
UPDATES_PER_ACTOR: Final = 3
"""The same, for each actor."""
WARM_UP: Final = 0.5
"""Updates before, as a share of those that are measured; the first of an actor is not like the others."""
STANDSTILL_S: Final = 3600.0
"""Simulated time without an update that is answered for good after which a run does not get on."""
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
    learner: dict[str, float]
    """Of the learner's own counters: ``version``, ``settled``, ``busy``, ``resent``, and bits ``up`` and ``down``."""
    actors: float
    """Seconds of the actors' cores."""
    waited: float
    """Seconds in which the learner's threads waited for the interpreter lock, in all."""
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
        self._host = self._make_host()
        self._actors = self._host if setting.one_host else Shared(env)
        self._latency = 0.0 if setting.one_host else setting.latency
        levels = setting.relays
        between = setting.hub_bandwidth if levels else setting.bandwidth
        self._learner = Learner(
            Place(env, self._host, self._make_link(between / setting.shards), self._latency),
            costs.part(setting.shards),
            clients=(*levels, setting.actors)[0],
            counted=self._counted,
            most_lag=most_lag(costs, setting),
        )
        self._samples: list[Node] = []
        """A relay of each level, one of those with most below it."""
        above: list[Node] = [self._learner]
        for relays, below in zip(levels, (*levels, setting.actors)[1:], strict=True):
            flow = setting.bandwidth if below == setting.actors else setting.hub_bandwidth
            # Those below take turns with those above, so the first ones have one more if it does not come out even.
            above = [
                self._make_relay(above[n % len(above)], flow, clients=-(-(below - n) // relays)) for n in range(relays)
            ]
            self._samples.append(above[0])
        for number in range(setting.actors):
            env.process(self._actor(above[number % len(above)]))

    def measure(self) -> Prediction:
        """Let it get under way, and measure it; if it does not get on, all of it is measured."""
        updates = max(LEAST_UPDATES, UPDATES_PER_ACTOR * self._setting.actors)
        before = int(WARM_UP * updates)
        start = self._moment()
        gets_on = self._run_until(before, before + updates)
        if gets_on:
            start, self._counted.lag_max = self._moment(), 0
            gets_on = self._run_until(before + updates, before + updates)
        return self._prediction(start, self._moment(), gets_on=gets_on)

    def _run_until(self, answered: int, last: int) -> bool:
        """Run until so many updates have been answered for good; False when the run stands still before."""
        self._until = answered
        while (so_far := self._counted.answered) < answered:
            self._goal = self._env.event()
            self._env.run(self._goal | self._env.timeout(STANDSTILL_S))
            if self._counted.answered == so_far:
                return False
            if self._progress is not None:
                self._progress(min(self._counted.answered / last, 1.0))
        return True

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
        self._counted.answered += 1
        if self._counted.answered >= self._until or self._counted.answered % _PROGRESS_EVERY == 0:
            self._answered()

    def _answered(self) -> None:
        if not self._goal.triggered:
            self._goal.succeed()

    def _make_host(self) -> Shared:
        costs = self._costs
        return Shared(self._env, self._setting.cores, crowding=costs.crowding, switching=costs.switching)

    def _make_link(self, flow: float) -> Link:
        bandwidth = math.inf if self._setting.one_host else self._setting.hub_bandwidth
        return Link(Way(self._env, bandwidth, flow, self._rng), Way(self._env, bandwidth, flow, self._rng))

    def _make_relay(self, above: Node, flow: float, *, clients: int) -> Node:
        place = Place(self._env, self._make_host(), self._make_link(flow), self._latency)
        return Relay(above, place, self._costs, clients=clients, counted=self._counted, rng=self._rng)

    def _moment(self) -> _Moment:
        learner = self._learner
        own = {name: getattr(learner, name) for name in ("version", "settled", "busy", "resent")}
        return _Moment(
            self._env.now,
            replace(self._counted),
            own | {"up": learner.link.up.bits, "down": learner.link.down.bits},
            self._actors.used(),
            sum(thread.waited for thread in (learner.main, learner.receiver, learner.server)),
            _used_by(learner) | {"host": self._host.used() / self._setting.cores},
            [_used_by(relay) for relay in self._samples],
        )

    def _prediction(self, start: _Moment, end: _Moment, *, gets_on: bool) -> Prediction:
        seconds = max(end.now - start.now, _TINY)
        count = {name: value - getattr(start.counted, name) for name, value in asdict(end.counted).items()}
        own = {name: value - start.learner[name] for name, value in end.learner.items()}
        used = {name: value - start.used[name] for name, value in end.used.items()}
        relays = [
            (value - before[name]) / seconds
            for before, after in zip(start.relays, end.relays, strict=True)
            for name, value in after.items()
        ]
        applied, settled = max(count["applied"], 1), max(own["settled"], 1)
        waited = end.waited - start.waited
        had_work = max(used["apply"] + used["receive"] + used["serve"] + waited, _TINY)
        cores = self._setting.cores if self._setting.one_host else self._setting.actors
        return Prediction(
            actors=self._setting.actors,
            gets_on=gets_on,
            frames_per_second=count["frames"] / seconds,
            updates_per_second=own["version"] / seconds,
            lag=count["lags"] / applied,
            lag_max=self._counted.lag_max,
            age=count["ages"] / applied,
            stale=count["stale"] / max(count["stale"] + count["applied"], 1),
            busy=own["busy"] / settled,
            resent=own["resent"] / settled,
            gil_wait=waited / had_work,
            actor_load=(end.actors - start.actors) / seconds / cores,
            relay_load=max(relays, default=None),
            megabits_up=1e-6 * own["up"] / seconds,
            megabits_down=1e-6 * own["down"] / seconds,
            simulated_seconds=seconds,
            **{f"{name}_load": value / seconds for name, value in used.items()},
        )


def most_lag(costs: Costs, setting: Setting) -> int:
    """Return the largest policy lag of a push that the learner applies, versions."""
    return RunConfig(learn_from=costs.learn_from, max_lag=setting.max_lag).most_lag  # type: ignore[arg-type]  # checked


def _used_by(node: Node) -> dict[str, float]:
    """Return the seconds in which each resource of a node was fully used."""
    return {
        "apply": node.main.worked,
        "receive": node.receiver.worked,
        "serve": node.server.worked,
        "gil": node.lock_used,
        "up": node.link.up.used(),
        "down": node.link.down.used(),
    }
