"""The processes of `hoz-dist reproduce`: each does one task after another, and dies with the command."""

import multiprocessing
import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnContext
from typing import Any, Final

from hoz_dist.cli.child import die_with_parent
from hoz_dist.cli.main import sentence_of
from hoz_dist.cli.processes import MOST_RESTARTS, STOP_S
from hoz_dist.cli.progress import Progress
from hoz_dist.cli.reproducing.task import Place, Report, frames_of, perform
from hoz_dist.errors import HozError, OwnMistakeError
from hoz_dist.reproduce.costs import Costs, makespan
from hoz_dist.reproduce.job import Task

OUR_MISTAKE: Final = "A process of this command failed by a mistake of ours; what it says is above."
"""Said when a process ended with a status above 0 and sent no reason; below 0 a signal killed it."""
_POLL_S: Final = 1.0
_SETTLED: Final = 0.05
"""Share of the work after which its speed tells more than the measurement before it."""


class Worker:
    """A process that works for the command; `receive` what it sends until it has ended.

    Args:
        context: Starts processes anew, so that they share nothing with this one.
        work: What it does; called with the arguments and the function that sends.
        arguments: Of ``work``.
    """

    def __init__(self, context: SpawnContext, work: Callable[..., None], *arguments: object) -> None:
        self._receiving, sending = context.Pipe(duplex=False)
        self._process = context.Process(target=_run, args=(work, arguments, sending, os.getpid()))
        # Ctrl-C reaches every process of the terminal, and this one acts on it. Processes start with their parent's
        # mask, so that it cannot hit one in the midst of its imports.
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        sending.close()

    @property
    def connection(self) -> Connection:
        """Becomes ready when there is something to receive, or the process has ended."""
        return self._receiving

    @property
    def exit_status(self) -> int | None:
        """None while it runs."""
        return self._process.exitcode

    def receive(self) -> list[Any]:
        """Return what it has sent since the last call."""
        received = []
        with suppress(EOFError, OSError):
            while self._receiving.poll():
                received.append(self._receiving.recv())
        return received

    def terminate(self) -> None:
        """Ask it to stop."""
        self._process.terminate()

    def join(self) -> None:
        """Wait until it has stopped; kill it if that takes too long: its own children take `STOP_S` each at most."""
        self._process.join(3 * STOP_S)
        if self._process.exitcode is None:
            self._process.kill()
            self._process.join()
        self._receiving.close()


def _run(work: Callable[..., None], arguments: Sequence[Any], sending: Connection, parent: int) -> None:
    """Work until done, failed or told to stop; the body of a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    die_with_parent(parent)
    sys.stdout = sys.stderr  # the command's standard output is its result
    status, stopped = 0, False
    try:
        work(*arguments, sending.send)
    except KeyboardInterrupt:
        stopped = True
    except (HozError, OSError) as error:
        sending.send(Report("failed", note=sentence_of(error)))
        status = 1
    # Its children have stopped. From here on SIGTERM ends it as it ends any process: not as a failure.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if stopped:
        os.kill(os.getpid(), signal.SIGTERM)
    sys.exit(status)


class _Assignment:
    """A task and the process that does it; started again when something kills it."""

    def __init__(self, context: SpawnContext, task: Task, place: Place) -> None:
        self.task = task
        self.report = Report("training")
        self._context = context
        self._place = place
        self._restarts = 0
        self.worker = Worker(context, perform, task, place)

    def follow(self) -> bool:
        """Take its reports; tell whether it is done.

        Raises:
            HozError: It failed, or was killed too often.
            OwnMistakeError: It failed without a reason.
        """
        status = self.worker.exit_status  # first: what it sent before its end is then there to be received
        for report in self.worker.receive():
            self.report = report
        if self.report.stage == "failed":
            raise HozError(self.report.note)
        if status is None:
            return False
        self.worker.join()
        if status == 0:
            return True
        if status > 0:
            raise OwnMistakeError(OUR_MISTAKE)
        if self._restarts >= MOST_RESTARTS:
            message = (
                "A process of this command was killed again and again, perhaps for want of memory; use fewer --jobs."
            )
            raise HozError(message)
        self._restarts += 1
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
        job = self.task.jobs[0]
        name = job.agent if self.task.training is None else f"{job.agent} {job.seed}"
        return f"{name}: {self.report.stage} {self.report.share:.0%} {self.report.note}".strip()


def seconds_left(tasks: Sequence[Task], place: Place, costs: Costs) -> list[float]:
    """Return the seconds of what is left of each task, in the order of the tasks."""
    return [
        costs.of_task(
            task,
            task.waiting(place.out),
            0 if task.training is None else frames_of(task.training, place.out),
            chosen=task.training is not None and task.jobs[0].choice(place.out).exists(),
        )
        for task in tasks
    ]


def run_tasks(tasks: Sequence[Task], place: Place, jobs: int, costs: Costs) -> None:
    """Do tasks in several processes, and show how far they are.

    Args:
        tasks: What is to do, in this order.
        place: Where things are kept.
        jobs: Number of processes.
        costs: Of the parts of the work.

    Raises:
        HozError: A task failed; what is finished is kept.
        OwnMistakeError: A process failed without a reason.
    """
    context = multiprocessing.get_context("spawn")
    waiting, running = deque(tasks), list[_Assignment]()
    of_task = dict(zip(tasks, seconds_left(tasks, place, costs), strict=True))
    expected, began, done = max(makespan(of_task.values(), jobs), 1e-9), time.monotonic(), 0
    with Progress("Reproducing", 1.0, None) as progress:
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    running.append(_Assignment(context, waiting.popleft(), place))
                wait([one.worker.connection for one in running], _POLL_S)
                ended = [one for one in running if one.follow()]
                done += len(ended)
                running = [one for one in running if one not in ended]
                left = makespan([*(one.left(costs) for one in running), *(of_task[task] for task in waiting)], jobs)
                share = max(0.0, 1.0 - left / expected)
                if share > _SETTLED:
                    left *= (time.monotonic() - began) / (share * expected)
                note = "  ".join([f"{done} of {len(tasks)} agents", *(one.text for one in running)])
                progress.update(min(share, 0.999) if running or waiting else 1.0, note, left=left)
        finally:
            for one in running:
                one.worker.terminate()
            for one in running:
                one.worker.join()
