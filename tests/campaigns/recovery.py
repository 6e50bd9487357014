"""Recovery: one fault at a time, and how long until training goes on as before.

python -m tests.campaigns.recovery --repeats 5 --folder runs/recovery
"""

import re
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from datetime import datetime
from pathlib import Path
from statistics import median
from typing import Any, Final, Literal, NamedTuple

import click

from hoz_dist.wire.membership.liveliness import Members
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.transport.session import open_client
from tests.campaigns.cluster import ROUTER, Cluster, prepare_views, start
from tests.campaigns.faults import PAUSE_S, Fault, Kind, strike
from tests.campaigns.helpers import pause
from tests.campaigns.journals import FrameRate, first_of
from tests.campaigns.report import show
from tests.campaigns.supervisor import Supervisor
from tests.waiting import until

Target = Literal["actor", "learner", "router", "leader"]
"""A `learner` has no standby, a `leader` has one."""
TARGETS: Final[tuple[Target, ...]] = ("actor", "router", "leader", "learner")
KINDS: Final[tuple[Kind, ...]] = ("kill", "pause")
MEDIAN_S: Final = 10.0
LONGEST_S: Final = 20.0
TAKE_OVER_S: Final = 5.0
IN_FLIGHT_S: Final = 0.1
"""Answers that the fault did not reach any more."""
RESTART_S: Final = 0.3
LEARNERS: Final = ("learner-a", "learner-b")
_LEADS: Final = re.compile(r"^(\S+ \S+) \w+ \S+ leads run \S+, epoch (\d+)", re.MULTILINE)


class Times(NamedTuple):
    """How long a campaign waits for what, seconds."""

    warm_up: float
    """Before the first fault: a policy that knows nothing yet makes longer episodes, and more frames."""
    before: float
    """Before each fault, to measure frames per second."""
    give_up: float
    """For frames per second to be back."""


USUAL: Final = Times(warm_up=45.0, before=10.0, give_up=60.0)


@dataclass(frozen=True)
class Recovery:
    """What came of one fault."""

    target: Target
    kind: Kind
    seconds: float | None
    """Until frames per second are back; None when they did not come back."""
    first_seconds: float | None
    """Until the next gradient: of the actor that was hit, else of any."""
    take_over_seconds: float | None
    """Until another learner leads, when the target has a standby; None also when none took over."""


@dataclass(frozen=True)
class RecoveryFigures:
    """All faults of a campaign."""

    frames_per_second: float
    """The median second before the faults."""
    recoveries: list[Recovery]
    late: list[str] = field(default_factory=list)
    """What takes longer than it may."""

    def to_json(self) -> dict[str, Any]:
        """Return the figures, by target and kind."""
        faults: dict[str, Any] = {}
        for recovery in self.recoveries:
            name = f"{recovery.target} {recovery.kind}"
            figures = asdict(recovery)
            kept = {key: figures[key] for key in ("seconds", "first_seconds", "take_over_seconds")}
            for key, value in kept.items():
                if value is not None:
                    faults.setdefault(name, {}).setdefault(key, []).append(round(value, 1))
        return {"frames_per_second": self.frames_per_second, "faults": faults, "late": self.late}


def recovery(
    folder: Path,
    cache: Path,
    port: int,
    targets: Sequence[Target],
    kinds: Sequence[Kind] = KINDS,
    repeats: int = 5,
    times: Times = USUAL,
) -> RecoveryFigures:
    """Bring about each fault so many times, one after another.

    Args:
        folder: For all files; empty or not there.
        cache: The view cache.
        port: A free TCP port of the loopback address.
        targets: What to hit.
        kinds: What to do to it.
        repeats: How often.
        times: How long it waits for what.
    """
    prepare_views(cache)
    alone = [target for target in targets if target == "learner"]
    recoveries: list[Recovery] = []
    rates: list[float] = []
    for name, some, learners in (
        ("standby", [target for target in targets if target not in alone], LEARNERS),
        ("alone", alone, LEARNERS[:1]),
    ):
        if not some:
            continue
        with _Service(folder / name, cache, port, learners, times).running() as service:
            service.warm_up()
            for _ in range(repeats):
                recoveries += [service.hit(target, kind) for kind in kinds for target in some]
            rates.append(service.frames_per_second)
    figures = RecoveryFigures(round(median(rates)), recoveries)
    for target in targets:
        for kind in kinds:
            some_recoveries = [one for one in recoveries if (one.target, one.kind) == (target, kind)]
            figures.late.extend(_late(f"{target} {kind}", target, some_recoveries))
    return figures


def _late(name: str, target: Target, recoveries: Sequence[Recovery]) -> list[str]:
    times = [one.seconds if one.seconds is not None else float("inf") for one in recoveries]
    too_late = []
    if median(times) > MEDIAN_S or max(times) > LONGEST_S:
        too_late.append(f"{name}: back after {', '.join(f'{time:.1f}' for time in times)} s")
    late = [one.take_over_seconds for one in recoveries if (one.take_over_seconds or float("inf")) > TAKE_OVER_S]
    if target == "leader" and late:
        too_late.append(f"{name}: taken over after {', '.join(map(str, late))} s")
    return too_late


class _Service:
    """Router, learners and two actors: fewer would not show that others work on, more would hide that one is away."""

    ACTORS: Final = ("actor-0", "actor-1")

    def __init__(self, folder: Path, cache: Path, port: int, learners: Sequence[str], times: Times) -> None:
        self._cluster = Cluster(folder, cache, f"tcp/127.0.0.1:{port}")
        self._learners = learners
        self._times, self._before = times, list[float]()

    @property
    def frames_per_second(self) -> float:
        """The median second before the faults."""
        return median(self._before)

    @contextmanager
    def running(self) -> Iterator["_Service"]:
        cluster = self._cluster
        options = ("--standby",) if len(self._learners) > 1 else ()
        with Supervisor(cluster.logs, RESTART_S) as self._supervisor:
            start(self._supervisor, cluster.router(), *(cluster.learner(name, *options) for name in self._learners))
            start(self._supervisor, *(cluster.actor(name) for name in self.ACTORS))
            with (
                open_client(cluster.endpoint, self._times.give_up) as session,
                Members(session, Keys(cluster.run.name)) as self._members,
            ):
                yield self

    def warm_up(self) -> None:
        """Wait until everybody is there and training is under way."""
        self._calm("router")
        pause(self._times.warm_up)

    def hit(self, target: Target, kind: Kind) -> Recovery:
        """Bring about one fault, and wait until all is as before."""
        name = self._calm(target)
        fault = strike(self._supervisor, name, kind, PAUSE_S)
        assert fault is not None
        self._before += self._rate().windows(fault.began - self._times.before, fault.began)
        pause(fault.ended - time.time())
        end = fault.began + self._times.give_up
        while self._seconds(fault) is None and time.time() < end:
            pause(1.0)
        hit = [fault.name] if target == "actor" else self.ACTORS
        until(lambda: self._first(fault, hit) is not None, "training to go on")
        take_over = self._taken_over(fault) if target == "leader" else None
        return Recovery(target, kind, self._seconds(fault), self._first(fault, hit), take_over)

    def _calm(self, target: Target) -> str:
        """Wait until all has been well for a while; returns the name of the program to hit."""
        until(lambda: self._supervisor.settled() and self._complete(), "all processes to be there")
        since = time.time()
        until(lambda: all(self._acts(actor, since) for actor in self.ACTORS), "all actors to train")
        pause(self._times.before)
        match target:
            case "actor":
                return self.ACTORS[0]
            case "router":
                return ROUTER
            case _:
                return next(member.id for member in self._members.current() if member.role == "learner")

    def _complete(self) -> bool:
        roles = sorted(member.role for member in self._members.current())
        return roles == sorted(["actor"] * len(self.ACTORS) + ["learner"] + ["standby"] * (len(self._learners) - 1))

    def _acts(self, actor: str, since: float) -> bool:
        return first_of(self._cluster.acknowledged(actor), actor, since) is not None

    def _rate(self) -> FrameRate:
        return FrameRate(self._cluster.acknowledged(*self.ACTORS))

    def _seconds(self, fault: Fault) -> float | None:
        now = time.time()
        return self._rate().recovery(fault.began, self._times.before, now - fault.began)

    def _first(self, fault: Fault, actors: Sequence[str]) -> float | None:
        """Return when one of some actors trained again; what it sent before its pause may be answered after it."""
        since = fault.ended if fault.name in actors else fault.began + IN_FLIGHT_S
        times = [first_of(self._cluster.acknowledged(actor), actor, since) for actor in actors]
        return min((time + since - fault.began for time in times if time is not None), default=None)

    def _taken_over(self, fault: Fault) -> float | None:
        log = (self._cluster.run / "learner.log").read_text(encoding="utf-8")
        times = (
            datetime.strptime(when, "%Y-%m-%d %H:%M:%S,%f").astimezone().timestamp() for when, _ in _LEADS.findall(log)
        )
        return next((when - fault.began for when in times if when > fault.began), None)


@click.command()
@click.option("--repeats", type=int, default=5, show_default=True)
@click.option("--target", "targets", type=click.Choice(TARGETS), multiple=True, default=TARGETS, show_default=True)
@click.option("--port", type=int, default=7461, show_default=True)
@click.option("--folder", type=click.Path(path_type=Path), required=True, help="For all files; a new one.")
def main(repeats: int, targets: Sequence[Target], port: int, folder: Path) -> None:
    """Bring about faults one by one and print how long each took to recover from, as JSON."""
    show("RECOVERY", recovery(folder, folder / "views", port, targets, repeats=repeats).to_json())


if __name__ == "__main__":
    main()
