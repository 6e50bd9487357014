"""Slow learner: one that is stopped nine tenths of the time, under more actors than it can serve.

python -m tests.campaigns.slow_learner --seconds 120 --folder runs/slow
"""

import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import click

from hoz_dist.wire.serving.inbox import MOST_WAITING
from learner.checkpoint import load_checkpoint
from tests.campaigns.audit import audit
from tests.campaigns.cluster import ROUTER, Cluster, start
from tests.campaigns.helpers import finish, helper, pause
from tests.campaigns.memory import MemoryWatch, highest
from tests.campaigns.pushers import Outcome, read_outcomes
from tests.campaigns.report import show
from tests.campaigns.supervisor import Supervisor
from tests.waiting import until

RUN_S: Final = 0.009
STOP_S: Final = 0.081
"""A learner that runs for one part and is stopped for nine is ten times slower, whatever it does."""
LEARNER: Final = "learner-a"
PUSHERS: Final = 48
PROCESSES: Final = 2
MOST_LAG: Final = 4096
"""Gradients wait long here; with the usual bound most would be refused as stale, by name, and busy would not show."""
COPIES: Final = 4
"""A gradient that waits is held as Zenoh's payload and as the message; so much again is on its way in."""


@dataclass(frozen=True)
class SlowFigures:
    """What came of all gradients."""

    seconds: float
    accepted_per_second_before: float
    """While the learner ran as it can."""
    accepted_per_second: float
    """While it was slow."""
    accepted: int
    refused: dict[str, int]
    """By reason."""
    busy: int
    """How often `busy` was answered."""
    unanswered: int
    """How often nobody answered a try."""
    most_tries: int
    memory_before: float
    """Most memory of the learner while it ran as it can, megabytes."""
    memory: float
    """Most while it was slow."""
    router_memory: float
    """Most memory of the router while the learner was slow, megabytes."""
    gradient_megabytes: float
    wrong: list[str] = field(default_factory=list)
    """What must never be; empty when all is well."""

    def to_json(self) -> dict[str, Any]:
        """Return the figures."""
        return asdict(self)


def slow_learner(folder: Path, port: int, before_s: float, seconds: float) -> SlowFigures:
    """Push as fast as a learner can, then go on while it is ten times slower.

    Args:
        folder: For all files; empty or not there.
        port: A free TCP port of the loopback address.
        before_s: How long it runs as it can.
        seconds: How long it is slow.
    """
    cluster = Cluster(folder, folder / "views", f"tcp/127.0.0.1:{port}")
    files = [folder / f"pushers-{number}.jsonl" for number in range(PROCESSES)]
    with Supervisor(cluster.logs) as supervisor, MemoryWatch(supervisor) as memory:
        start(supervisor, cluster.router(), cluster.learner(LEARNER, "--max-lag", str(MOST_LAG)))
        with _pushers(cluster, files) as pushers:
            until(lambda: all(file.exists() and read_outcomes(file) for file in files), "gradients")
            began = time.time()
            pause(before_s)
            slow_since = time.time()
            with _slowed(supervisor):
                pause(seconds)
                slow_until = time.time()
                finish(*pushers)
        supervisor.stop(LEARNER)
        ended_early = [life for life in supervisor.lives if not life.struck and life.ended is not None]
    outcomes = [outcome for file in files for outcome in read_outcomes(file)]
    results = Counter(outcome.result for outcome in outcomes)
    figures = SlowFigures(
        seconds=round(slow_until - slow_since, 1),
        accepted_per_second_before=round(_accepted_per_second(outcomes, began, slow_since), 1),
        accepted_per_second=round(_accepted_per_second(outcomes, slow_since, slow_until), 1),
        accepted=results.pop("accepted", 0),
        refused=dict(results),
        busy=sum(outcome.busy for outcome in outcomes),
        unanswered=sum(outcome.unanswered for outcome in outcomes),
        most_tries=max(outcome.tries for outcome in outcomes),
        memory_before=round(highest(memory.samples[LEARNER], began, slow_since)),
        memory=round(highest(memory.samples[LEARNER], slow_since, slow_until)),
        router_memory=round(highest(memory.samples[ROUTER], slow_since, slow_until)),
        gradient_megabytes=round(_gradient_megabytes(cluster.run), 2),
    )
    figures.wrong.extend(_wrong(figures, cluster.run, outcomes))
    figures.wrong.extend(f"{life.program.name} ended by itself" for life in ended_early)
    return figures


@contextmanager
def _pushers(cluster: Cluster, files: Sequence[Path]) -> Iterator[list[Any]]:
    with ExitStack() as stack:
        yield [
            stack.enter_context(
                helper(
                    *("pushers", "--connect", cluster.endpoint, "--run", cluster.run.name, "--out", str(file)),
                    *("--prefix", f"p{number}-", "--actors", str(PUSHERS // len(files))),
                    log=file.with_suffix(".log"),
                )
            )
            for number, file in enumerate(files)
        ]


@contextmanager
def _slowed(supervisor: Supervisor) -> Iterator[None]:
    """Stop the learner most of the time, many times a second, meanwhile."""
    process, done = supervisor.running()[LEARNER].process, threading.Event()

    def alternate() -> None:
        while not done.is_set():
            process.send_signal(signal.SIGSTOP)
            done.wait(STOP_S)
            process.send_signal(signal.SIGCONT)
            done.wait(RUN_S)

    thread = threading.Thread(target=alternate, name="slows the learner")
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def _accepted_per_second(outcomes: Sequence[Outcome], begin: float, end: float) -> float:
    return sum(outcome.result == "accepted" and begin <= outcome.time < end for outcome in outcomes) / (end - begin)


def _gradient_megabytes(run: Path) -> float:
    return load_checkpoint(run).parameters.nbytes / 1e6


def _wrong(figures: SlowFigures, run: Path, outcomes: Sequence[Outcome]) -> list[str]:
    found = audit(run, [])
    accepted = Counter(
        (outcome.actor, outcome.incarnation, outcome.sequence) for outcome in outcomes if outcome.result == "accepted"
    )
    wrong = [*found.figures.problems]
    if found.record != accepted:
        missing, extra = accepted - found.record, found.record - accepted
        wrong.append(f"accepted and not recorded: {missing.total()}; recorded and not accepted: {extra.total()}")
    allowed = figures.memory_before + COPIES * MOST_WAITING * figures.gradient_megabytes
    if figures.memory > allowed:
        wrong.append(f"the learner's memory grew from {figures.memory_before} to {figures.memory} MB")
    if not figures.busy:
        wrong.append("nobody was told busy")
    if figures.refused.keys() - {"epoch", "stale"}:
        wrong.append(f"valid gradients were refused: {figures.refused}")
    return wrong


@click.command()
@click.option("--seconds", type=float, default=120.0, show_default=True)
@click.option("--port", type=int, default=7462, show_default=True)
@click.option("--folder", type=click.Path(path_type=Path), required=True, help="For all files; a new one.")
def main(seconds: float, port: int, folder: Path) -> None:
    """Slow a learner down and print what became of all gradients as JSON."""
    show("SLOW LEARNER", slow_learner(folder, port, 15.0, seconds).to_json())


if __name__ == "__main__":
    main()
