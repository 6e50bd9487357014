"""`hoz-dist bench train`: frames per second of a whole run, where its time goes, and what an update costs.

Runs take turns: while one is measured the actors of the others stand still, and their learners have nothing to do. Who
stands still for longer than Zenoh's lease loses its session, and makes a new one before it is measured again.
"""

import statistics
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Final

from hoz_dist.bench.report import Metric
from hoz_dist.bench.timing import Contender, Progress, run_contests
from hoz_dist.bench.timings import TimingsFile, Totals, between
from hoz_dist.errors import HozError

ACTOR_STAGES: Final = ("act", "differentiate", "push", "answer", "wait", "parameters", "load", "rooms", "report")
"""Stages of an actor, `workers.actor`; ``answer`` is the wait for that of the learner to a push."""
AHEAD: Final = frozenset({"push", "answer", "report"})
"""Stages that go on in another thread while rollouts are acted, and ``wait`` is the wait for their end."""
WAITING: Final = frozenset({"answer", "wait", "parameters"})
"""Stages in which an actor mostly waits for the learner."""
LEARNER_STAGES: Final = ("receive", "apply", "differentiate", "publish", "serve", "record", "idle")
"""Stages of a learner, `learner.serving`; ``receive`` and ``serve`` are of other threads than the rest."""
SETTLING: Final = 2
"""Updates of each actor before it is measured, after it stood still."""
LONGEST_S: Final = 300.0
"""How long an actor may go without an update while it is to train, seconds."""
_POLL_S: Final = 0.05


class Trainers(ABC):
    """Processes that train, and can stand still meanwhile."""

    files: Sequence[TimingsFile]
    """What each actor, or what takes its place, writes."""

    @abstractmethod
    def resume(self) -> None:
        """Let them train."""

    @abstractmethod
    def pause(self) -> None:
        """Let them stand still."""

    @abstractmethod
    def check(self) -> None:
        """Look whether all still work.

        Raises:
            HozError: One failed.
        """

    def learner(self) -> Totals:
        """Return the learner's totals; empty without a learner."""
        return {}

    def await_updates(self, count: int, since: float) -> None:
        """Wait until every actor has made so many updates since a time.

        Raises:
            HozError: A process failed, or does not get on.
        """
        began = time.time()
        while any(file.updates_since(since) < count for file in self.files):
            self._check_progress(began)
            time.sleep(_POLL_S)

    def await_rooms(self) -> Iterator[int]:
        """Wait until every actor trains in all of its rooms; yields how many do, again and again.

        Raises:
            HozError: A process failed, or does not get on.
        """
        began = time.time()
        while (ready := sum(file.is_ready for file in self.files)) < len(self.files):
            self._check_progress(began)
            yield ready
            time.sleep(_POLL_S)

    def _check_progress(self, began: float) -> None:
        """Look whether all still work and get on, as they should since a time."""
        self.check()
        recent = time.time() - LONGEST_S
        if began < recent and not all(file.updates_since(recent) for file in self.files):
            message = f"An actor made no update for {LONGEST_S:g} s; measure fewer actors, or fewer rooms."
            raise HozError(message)


@dataclass(frozen=True)
class Window:
    """What was done in a span of time."""

    seconds: float
    actors: Totals
    """Of all actors together."""
    learner: Totals
    """Empty without a learner."""

    @property
    def frames_per_second(self) -> float:
        """Frames that came to something."""
        return self.actors["frames"] / self.seconds

    @property
    def updates(self) -> float:
        """Updates of all actors."""
        return max(self.actors["updates"], 1e-9)

    def actor(self, name: str) -> float:
        """Return a total of an update, of an actor."""
        return self.actors.get(name, 0.0) / self.updates

    def of_learner(self, name: str) -> float:
        """Return a total of an update, of the learner."""
        return self.learner.get(name, 0.0) / self.updates


@dataclass
class Measured:
    """Windows of one group of processes."""

    trainers: Trainers
    windows: list[Window] = field(default_factory=list)

    def measure(self, seconds: float) -> float:
        """Let them train for a while; returns the frames per second.

        Raises:
            HozError: A process failed.
        """
        trainers = self.trainers
        trainers.resume()
        trainers.await_updates(SETTLING, time.time())
        begin, learner = time.time(), trainers.learner()
        time.sleep(seconds)
        end, learner = time.time(), between(learner, trainers.learner())
        trainers.await_updates(1, end)
        trainers.pause()
        actors: Totals = {}
        for file in trainers.files:
            for name, amount in between(file.at(begin), file.at(end)).items():
                actors[name] = actors.get(name, 0.0) + amount
        self.windows.append(Window(end - begin, actors, learner))
        return self.windows[-1].frames_per_second

    def median(self, figure: Callable[[Window], float]) -> float:
        """Return the median over the windows of a function of a window."""
        return statistics.median(figure(window) for window in self.windows)


def measure_in_turns(
    groups: Mapping[str, Trainers], *, seconds: float, repeats: int, progress: Progress
) -> dict[str, Measured]:
    """Measure groups of processes in turns.

    Args:
        groups: By name; none of them is training.
        seconds: Length of one window.
        repeats: Windows of each.
        progress: Told how far the work is.

    Raises:
        HozError: A process failed.
    """
    measured = {name: Measured(trainers) for name, trainers in groups.items()}

    @contextmanager
    def contest() -> Iterator[Mapping[str, Contender]]:
        yield {name: partial(one.measure, seconds) for name, one in measured.items()}

    run_contests([contest], repeats, progress)
    for one in measured.values():
        del one.windows[0]  # of the round that warms up
    return measured


def metrics_of(run: Measured, alone: Measured | None, suffix: str = "") -> dict[str, Metric]:
    """Return the figures of a run.

    Args:
        run: The run.
        alone: The same without Zenoh, in one process each: the limit; None if that was not measured.
        suffix: Of the names of the figures.
    """
    windows = run.windows
    speeds = [window.frames_per_second for window in windows]
    limits = [window.frames_per_second for window in alone.windows] if alone is not None else None
    metrics = {"frames_per_second": Metric.of(speeds, "frames/s", limits)}
    if limits is not None:
        ratios = [speed / limit for speed, limit in zip(speeds, limits, strict=True)]
        metrics["share_of_in_process"] = Metric.of(ratios, "x in process", 1.0)
    metrics["updates_per_second"] = Metric.of([w.updates / w.seconds for w in windows], "1/s")
    for stage in (*ACTOR_STAGES, "other"):
        limit = 1e3 * alone.median(partial(_wall, stage=stage)) if alone is not None else None
        samples = [1e3 * _wall(window, stage) for window in windows]
        metrics[f"actor_{stage}_ms"] = Metric.of(samples, "ms/update", limit or None)
    for stage in LEARNER_STAGES:
        samples = [1e3 * window.of_learner(f"{stage}.wall") for window in windows]
        metrics[f"learner_{stage}_ms"] = Metric.of(samples, "ms/update")
    metrics["actor_cpu_ms"] = Metric.of([1e3 * window.actor("cpu") for window in windows], "ms/update")
    metrics["learner_cpu_ms"] = Metric.of([1e3 * window.of_learner("cpu") for window in windows], "ms/update")
    return {f"{name}{suffix}": metric for name, metric in metrics.items()}


def turns_metric(one: Measured, two: Measured) -> Metric:
    """Return how much processor time a frame takes two processes that take turns on a core, relative to one alone.

    That is the speed of the one divided by that of both together, if nothing else runs on the core; what does changes
    speeds far more than processor time.

    Args:
        one: A process that has a core to itself.
        two: That and another one, on the same core.
    """
    pairs = zip(one.windows, two.windows, strict=True)
    return Metric.of([_cpu_of_a_frame(both) / _cpu_of_a_frame(alone) for alone, both in pairs], "x alone", 1.0)


def prediction_metrics(run: Measured, predicted: float, suffix: str) -> dict[str, Metric]:
    """Return how a prediction compares with a run.

    Args:
        run: The run.
        predicted: Its predicted frames per second.
        suffix: Of the names of the figures.
    """
    ratios = [predicted / window.frames_per_second for window in run.windows]
    return {
        f"predicted_frames_per_second{suffix}": Metric.of([predicted], "frames/s"),
        f"prediction_ratio{suffix}": Metric.of(ratios, "x measured", 1.0),
    }


def bottleneck(run: Measured) -> str:
    """Name the stage that a run waits for most, such as ``actor differentiate``.

    It is the stage in which an actor spends most of its time; if it spends that waiting for the learner, it is the
    stage in which the learner does.
    """
    longest = max((*_own(run.windows[0]), "other"), key=lambda stage: run.median(lambda w: _wall(w, stage)))
    if longest not in WAITING:
        return f"actor {longest}"
    busy = [stage for stage in LEARNER_STAGES if stage != "idle"]
    return f"learner {max(busy, key=lambda stage: run.median(lambda w: w.of_learner(f'{stage}.wall')))}"


def _cpu_of_a_frame(window: Window) -> float:
    return window.actors["cpu"] / window.actors["frames"]


def _wall(window: Window, stage: str) -> float:
    """Return the time of a stage of an actor's update, seconds."""
    if stage != "other":
        return window.actor(f"{stage}.wall")
    own = sum(window.actors.get(f"{name}.wall", 0.0) for name in _own(window))
    return (window.actors["wall"] - own) / window.updates


def _own(window: Window) -> list[str]:
    """Return the stages of an actor's main thread."""
    ahead = AHEAD if window.actors.get("wait.count", 0.0) > 0 else frozenset()
    return [stage for stage in ACTOR_STAGES if stage not in ahead]
