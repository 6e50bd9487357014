"""The crew of `hoz-dist reproduce`: processes that do one task each, and what becomes of tasks that fail."""

import multiprocessing
import time
from collections import deque
from collections.abc import Callable, Sequence
from multiprocessing.connection import wait
from multiprocessing.context import SpawnContext
from typing import Final

from hoz_dist.cli.processes import MOST_RESTARTS
from hoz_dist.cli.progress import Progress
from hoz_dist.cli.reproducing.task import Place, Report, frames_of, perform
from hoz_dist.cli.reproducing.worker import OUR_MISTAKE, Failure, Worker
from hoz_dist.errors import DamagedFileError, HozError, OwnMistakeError
from hoz_dist.reproduce.costs import Costs, makespan
from hoz_dist.reproduce.job import Task

_POLL_S: Final = 1.0
_SETTLED: Final = 0.05
"""Share of the work after which its speed tells more than the measurement before it."""
_KILLED: Final = "Its process was killed again and again, perhaps for want of memory; use fewer --jobs."


class _Assignment:
    """A task and the process that does it; started again when something kills it, and once when it fails."""

    def __init__(self, context: SpawnContext, task: Task, place: Place) -> None:
        self.task = task
        self.report = Report("training")
        self.failure: str | None = None
        """Why it failed, in a sentence."""
        self._context = context
        self._place = place
        self._kills = 0
        self._failed_before = False
        self.worker = Worker(context, perform, task, place)

    def follow(self, say: Callable[[str], None]) -> bool:
        """Take its reports, and start it again where that may help.

        Args:
            say: Told what failed.

        Returns:
            Whether it has ended: done, or with a `failure`.

        Raises:
            OwnMistakeError: It failed without a reason.
        """
        status = self.worker.exit_status  # first: what it sent before its end is then there to be received
        for sent in self.worker.receive():
            if isinstance(sent, Failure):
                self.failure = sent.sentence
            else:
                self.report = sent
        if status is None:
            return False
        self.worker.join()
        if status == 0:
            return True
        if self.failure is not None:
            if self._failed_before:
                say(f"{self.task.name} failed again, and waits for the next start of this command: {self.failure}")
                return True
            # What fails may pass: a learner that a busy machine keeps from answering, a port that another one took.
            say(f"{self.task.name} failed, and is started once more: {self.failure}")
            self.failure, self._failed_before = None, True
        elif status > 0:
            message = f"{self.task.name}: {OUR_MISTAKE}"
            raise OwnMistakeError(message)
        else:
            self._kills += 1
            if self._kills > MOST_RESTARTS:
                self.failure = _KILLED
                say(f"{self.task.name} waits for the next start of this command: {self.failure}")
                return True
        self.worker = Worker(self._context, perform, self.task, self._place)
        return False

    def left(self, costs: Costs) -> float:
        """Return the seconds that are left, as far as measured costs tell."""
        stage, share, _ = self.report
        waiting = self.task.waiting(self._place.out)
        training = self.task.training
        done = 0 if training is None else training.frames
        if stage == "training" and training is not None:
            done = int(share * training.frames)
        left = costs.of_task(self.task, waiting, done, chosen=stage == "testing")
        if stage == "testing" and waiting:
            left -= share * costs.of_test(waiting[0])
        return left

    @property
    def text(self) -> str:
        """Which run it is, and how far."""
        return f"{self.task.name}: {self.report.stage} {self.report.share:.0%} {self.report.note}".strip()


def seconds_left(tasks: Sequence[Task], place: Place, costs: Costs) -> list[float]:
    """Return the seconds of what is left of each task, in the order of the tasks."""
    return [
        costs.of_task(
            task,
            task.waiting(place.out),
            _frames_made(task, place),
            chosen=task.training is not None and task.jobs[0].choice(place.out).exists(),
        )
        for task in tasks
    ]


def _frames_made(task: Task, place: Place) -> int:
    if task.training is None:
        return 0
    try:
        return frames_of(task.training, place.out)
    except DamagedFileError:
        return 0  # its own process says so, and keeps no other from being done


def run_tasks(tasks: Sequence[Task], place: Place, jobs: int, costs: Costs) -> None:
    """Do tasks in several processes, and show how far they are; one that fails keeps no other from being done.

    Args:
        tasks: What is to do, in this order.
        place: Where things are kept.
        jobs: Number of processes.
        costs: Of the parts of the work.

    Raises:
        HozError: Tasks failed, and all others are done.
        OwnMistakeError: A process failed without a reason, which ended the others; what is finished is kept.
    """
    context = multiprocessing.get_context("spawn")
    waiting, running = deque(tasks), list[_Assignment]()
    of_task = dict(zip(tasks, seconds_left(tasks, place, costs), strict=True))
    expected, began, done = max(makespan(of_task.values(), jobs), 1e-9), time.monotonic(), 0
    failed: list[_Assignment] = []
    with Progress("Reproducing", 1.0, None) as progress:
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    running.append(_Assignment(context, waiting.popleft(), place))
                wait([one.worker.connection for one in running], _POLL_S)
                ended = [one for one in running if one.follow(progress.say)]
                failed += [one for one in ended if one.failure is not None]
                done += sum(one.failure is None for one in ended)
                running = [one for one in running if one not in ended]
                left = makespan([*(one.left(costs) for one in running), *(of_task[task] for task in waiting)], jobs)
                share = max(0.0, 1.0 - left / expected)
                if share > _SETTLED:
                    left *= (time.monotonic() - began) / (share * expected)
                count = f"{done} of {len(tasks)} agents" + (f", {len(failed)} failed" if failed else "")
                note = "  ".join([count, *(one.text for one in running)])
                progress.update(min(share, 0.999) if running or waiting else 1.0, note, left=left)
        finally:
            for one in running:
                one.worker.terminate()
            for one in running:
                one.worker.join()
    if failed:
        first = failed[0]
        message = (
            f"{len(failed)} of {len(tasks)} agents failed, and the same command tries again; "
            f"first '{first.task.name}': {first.failure}"
        )
        raise HozError(message)
