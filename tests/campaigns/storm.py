"""Storm: router, two learners and four actors, any of which is killed or stands still at any moment.

python -m tests.campaigns.storm --minutes 10 --faults 66 --folder runs/storm
"""

import json
import random
import re
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, Final

import click

from tests.campaigns.audit import AuditFigures, audit
from tests.campaigns.cluster import ROUTER, Cluster, prepare_views, start
from tests.campaigns.faults import PAUSE_S, carry_out, plan
from tests.campaigns.helpers import finish, helper, pause
from tests.campaigns.journals import Acknowledged, FrameRate
from tests.campaigns.memory import MemoryWatch, Sample, highest
from tests.campaigns.report import show
from tests.campaigns.supervisor import Life, Supervisor
from tests.campaigns.windows import QueryFigures, Window, query_figures, read_notes, windows_without_leader
from tests.waiting import until

LEARNERS: Final = ("learner-a", "learner-b")
SETTLED_MEMORY_S: Final = 120.0
MEMORY_GROWTH: Final = 1.10
QUERY_SHARE: Final = 0.99
QUERY_P99_S: Final = 0.25
PROGRESS_S: Final = 30.0
"""Training must have got on in every such window that has a leader for `LED_S`."""
LED_S: Final = 10.0
ALLOWED_REASONS: Final = {"epoch", "stale"}
_REJECTED: Final = re.compile(r"rejected a message of \S+ \((\w+)\)")
_ORDERLY_CODES: Final = {0, 2}
"""Statuses of a process that ends in an orderly way: done, or a sentence for the user, such as that nobody answers."""


@dataclass(frozen=True)
class Settings:
    """How hard the storm is."""

    seconds: float
    faults: int
    actors: int = 4
    seed: int = 0
    pause_s: float = PAUSE_S
    restart_s: float = 0.5
    calm_s: float = 20.0
    """How long training goes on before the first fault and after the last."""


@dataclass(frozen=True)
class MemoryFigures:
    """Most memory of a program's processes, megabytes."""

    first: float
    """In the first two minutes."""
    later: float

    @property
    def growth(self) -> float:
        """Later over first."""
        return self.later / self.first if self.first else float("inf")


@dataclass(frozen=True)
class StormFigures:
    """What a storm did and what came of it."""

    seconds: float
    kills: int
    pauses: int
    faults_by_program: dict[str, int]
    frames_per_second: float
    """Over the whole storm."""
    undisturbed_frames_per_second: float
    """The median second in the calm before the storm."""
    audit: AuditFigures
    rejected: dict[str, int]
    """Log lines about rejections by reason; the log has one in 10 s for a sender and a reason."""
    queries: QueryFigures
    windows: list[Window]
    memory: dict[str, MemoryFigures]
    ended_by_themselves: list[str]
    wrong: list[str] = field(default_factory=list)
    """What must never be; empty when all is well."""
    late: list[str] = field(default_factory=list)
    """What takes longer, or more memory, than it may."""

    def to_json(self) -> dict[str, Any]:
        """Return the figures, with windows summed up."""
        seconds = sorted(window.seconds for window in self.windows)
        return asdict(self) | {
            "windows": {
                "count": len(seconds),
                "total_seconds": round(sum(seconds), 1),
                "median_seconds": round(median(seconds), 2) if seconds else 0.0,
                "longest_seconds": round(seconds[-1], 2) if seconds else 0.0,
                "not_excused": [window for window in self.windows if window.fault is None],
            },
            "memory": {
                name: f"{figures.first:.0f} MB, later {figures.later:.0f} MB" for name, figures in self.memory.items()
            },
        }


def storm(folder: Path, cache: Path, port: int, settings: Settings) -> StormFigures:
    """Run a storm.

    Args:
        folder: For all files; empty or not there.
        cache: The view cache.
        port: A free TCP port of the loopback address.
        settings: How hard it is.
    """
    prepare_views(cache)
    cluster = Cluster(folder, cache, f"tcp/127.0.0.1:{port}")
    actors = [f"actor-{number}" for number in range(settings.actors)]
    names = [ROUTER, *LEARNERS, *actors]
    notes_file = folder / "prober.jsonl"
    with Supervisor(cluster.logs, settings.restart_s) as supervisor, MemoryWatch(supervisor) as memory:
        start(supervisor, cluster.router(), *(cluster.learner(name, "--standby") for name in LEARNERS))
        start(supervisor, *(cluster.actor(name) for name in actors))
        words = ("--connect", cluster.endpoint, "--run", cluster.run.name, "--out", str(notes_file))
        with helper("prober", *words, log=cluster.logs / "prober.log") as prober:
            until(lambda: all(_trains(cluster, actor) for actor in actors), "gradients of all actors")
            calm = time.time()
            pause(settings.calm_s)
            began = time.time()
            blows = plan(random.Random(settings.seed), names, settings.seconds, settings.faults)
            faults = carry_out(supervisor, blows, names, settings.pause_s)
            pause(began + settings.seconds - time.time())
            until(supervisor.settled, "all processes to run")
            pause(settings.calm_s)
            ended = time.time()
            finish(prober)
        supervisor.stop(*actors)
        supervisor.stop(*LEARNERS)
        supervisor.stop(ROUTER)
    memory.save(folder / "memory.json")
    acknowledged = cluster.acknowledged(*actors)
    notes = read_notes(notes_file)
    (folder / "faults.json").write_text(json.dumps(faults), encoding="utf-8")
    windows = windows_without_leader(notes.leaders, faults, router=ROUTER, learners=LEARNERS, end=ended)
    rate, found = FrameRate(acknowledged), audit(cluster.run, acknowledged)
    figures = StormFigures(
        seconds=round(ended - began, 1),
        kills=sum(fault.kind == "kill" for fault in faults),
        pauses=sum(fault.kind == "pause" for fault in faults),
        faults_by_program=dict(Counter(fault.name for fault in faults)),
        frames_per_second=round(rate.between(began, ended)),
        undisturbed_frames_per_second=round(median(rate.windows(calm, began))),
        audit=found.figures,
        rejected=_rejections(supervisor, names),
        queries=query_figures(notes.questions, windows),
        windows=windows,
        memory={name: _memory(samples, calm, ended) for name, samples in _by_program(memory.samples).items()},
        ended_by_themselves=_ended_by_themselves(supervisor.lives),
    )
    figures.wrong.extend(_wrong(figures, supervisor, names))
    figures.late.extend([*_late(figures), *_standstills(found.lasting, windows, began, ended)])
    return figures


def _trains(cluster: Cluster, actor: str) -> bool:
    return any(push.kind == "gradient" for push in cluster.acknowledged(actor))


def _by_program(samples: dict[str, list[Sample]]) -> dict[str, list[Sample]]:
    """Take the learners together: each leads some of the time, and the one that leads needs more."""
    learners = [sample for name in LEARNERS for sample in samples[name]]
    return {"learners": learners} | {name: some for name, some in samples.items() if name not in LEARNERS}


def _memory(samples: list[Sample], began: float, ended: float) -> MemoryFigures:
    settled = began + SETTLED_MEMORY_S
    return MemoryFigures(highest(samples, began, settled), highest(samples, settled, ended))


def _rejections(supervisor: Supervisor, names: Sequence[str]) -> dict[str, int]:
    return dict(Counter(reason for name in names for reason in _REJECTED.findall(supervisor.said(name))))


def _ended_by_themselves(lives: Sequence[Life]) -> list[str]:
    return [f"{life.program.name} ended with status {life.code}" for life in lives if not life.struck and life.code]


def _wrong(figures: StormFigures, supervisor: Supervisor, names: Sequence[str]) -> list[str]:
    wrong = [*figures.audit.problems]
    wrong += [f"{reason} is no reason to reject" for reason in figures.rejected.keys() - ALLOWED_REASONS]
    wrong += [f"{name} printed a traceback" for name in names if "Traceback" in supervisor.said(name)]
    wrong += [
        f"{life.program.name} ended by itself with status {life.code}"
        for life in supervisor.lives
        if not life.struck and life.code not in _ORDERLY_CODES
    ]
    return wrong


def _late(figures: StormFigures) -> list[str]:
    queries = figures.queries
    late = [
        f"memory of {name} grew from {some.first:.0f} to {some.later:.0f} MB"
        for name, some in figures.memory.items()
        if some.later and some.growth >= MEMORY_GROWTH
    ]
    if queries.share < QUERY_SHARE:
        late.append(f"only {queries.share:.2%} of the graph queries were answered")
    if queries.p99_seconds > QUERY_P99_S:
        late.append(f"the 99th percentile of the answers is {queries.p99_seconds:.3f} s")
    return late


def _standstills(lasting: Sequence[Acknowledged], windows: Sequence[Window], began: float, ended: float) -> list[str]:
    """Name the times in which training did not get on although there was a leader."""
    times = [push.time for push in lasting]
    problems = []
    for k in range(int((ended - began) / PROGRESS_S)):
        begin, end = began + k * PROGRESS_S, began + (k + 1) * PROGRESS_S
        without = sum(max(min(w.ended, end) - max(w.began, begin), 0.0) for w in windows)
        if PROGRESS_S - without > LED_S and not any(begin <= time < end for time in times):
            problems.append(f"no update from {begin - began:.0f} to {end - began:.0f} s lasted")
    return problems


@click.command()
@click.option("--minutes", type=float, default=10.0, show_default=True)
@click.option("--faults", type=int, default=66, show_default=True)
@click.option("--seed", type=int, default=0, show_default=True)
@click.option("--port", type=int, default=7460, show_default=True)
@click.option("--folder", type=click.Path(path_type=Path), required=True, help="For all files; a new one.")
def main(minutes: float, faults: int, seed: int, port: int, folder: Path) -> None:
    """Run a storm and print its figures as JSON."""
    figures = storm(folder, folder / "views", port, Settings(seconds=60 * minutes, faults=faults, seed=seed))
    show("STORM", figures.to_json())


if __name__ == "__main__":
    main()
