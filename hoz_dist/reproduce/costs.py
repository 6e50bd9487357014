"""How long a table takes: what each part of the work costs, and how tasks fill the processes that do them; no clock."""

import heapq
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from hoz_dist.nav.episode import evaluation_cap
from hoz_dist.reproduce.job import Job, Task, Training

START_S: Final = 10.0
"""Starting a learner and an actor, opening the rooms and saving the last checkpoint, seconds."""
STEP_S: Final = 0.00002
"""A step of an episode of an agent that is not trained takes this long, seconds; it looks at nothing."""
SHARE_COMPUTED: Final = 0.2
"""Steps that a trial computes over those of all its episodes up to the largest cap: most end long before, and those
that have ended are soon dropped."""


class Speed(NamedTuple):
    """What was measured of an agent while as many processes were busy as will be."""

    frames_per_second: float
    """Of training from its beginning, in one process. A learner and an actor take about as long: what sending costs
    (docs/performance.md), they save later, when episodes are longer and fewer begin."""
    step_seconds: float
    """Of one step of one episode of a trial."""


@dataclass(frozen=True)
class Costs:
    """What the parts of the work cost on this machine."""

    speeds: Mapping[str, Speed]
    """By `Training.digest`."""
    render_seconds: float = 0.0
    """For the rooms that the view cache lacks, all processes together at work."""

    def of_training(self, training: Training, done: int = 0) -> float:
        """Return the seconds of what is left of a training.

        Args:
            training: The training.
            done: Frames that it has made already.
        """
        left = max(0, training.frames - done)
        return START_S + left / self.speeds[training.digest].frames_per_second if left else 0.0

    def of_test(self, job: Job) -> float:
        """Return the seconds of a test."""
        protocol = job.protocol
        return protocol.trials * self._trial(job.training, protocol.scenes, protocol.test_episodes)

    def of_choice(self, job: Job) -> float:
        """Return the seconds of choosing a checkpoint; 0 for an agent that is not trained."""
        if job.training is None:
            return 0.0
        protocol = job.protocol
        return protocol.candidates * self._trial(job.training, protocol.scenes, protocol.validation_episodes)

    def of_task(self, task: Task, waiting: Iterable[Job], done: int = 0, *, chosen: bool = False) -> float:
        """Return the seconds of what is left of a task.

        Args:
            task: The task.
            waiting: Its jobs that have no result yet.
            done: Frames that its training has made already.
            chosen: Whether its checkpoint is chosen already.
        """
        jobs = list(waiting)
        if not jobs:
            return 0.0
        before = 0.0 if task.training is None else self.of_training(task.training, done)
        return before + (0.0 if chosen else self.of_choice(jobs[0])) + sum(map(self.of_test, jobs))

    def _trial(self, training: Training | None, scenes: Iterable[str], episodes: int) -> float:
        """Return the seconds of one trial."""
        step = STEP_S if training is None else self.speeds[training.digest].step_seconds
        caps = [evaluation_cap(scene) for scene in scenes]
        return SHARE_COMPUTED * step * episodes * len(caps) * max(caps)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            "render_seconds": round(self.render_seconds, 1),
            "speeds": {
                digest: {"frames_per_second": round(speed.frames_per_second), "step_seconds": speed.step_seconds}
                for digest, speed in self.speeds.items()
            },
        }


def makespan(seconds: Iterable[float], processes: int) -> float:
    """Return when the last of some tasks ends, if each process takes the next one as soon as it is free.

    Args:
        seconds: Of each task, in the order in which they are begun.
        processes: Number of processes, at least one.
    """
    ends = [0.0] * processes
    for one in seconds:
        heapq.heapreplace(ends, ends[0] + one)
    return max(ends)
