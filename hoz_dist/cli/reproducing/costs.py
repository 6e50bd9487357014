"""Measures, before `hoz-dist reproduce` begins, what the parts of its work will cost."""

import multiprocessing
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any, Final

from hoz_dist.cli.progress import Progress
from hoz_dist.cli.rendering import Encoding, missing_rooms, render_rooms
from hoz_dist.cli.reproducing.worker import OUR_MISTAKE, Failure, Worker
from hoz_dist.errors import HozError, OwnMistakeError
from hoz_dist.policy.threads import use_one_thread
from hoz_dist.reproduce.costs import Costs, Speed
from hoz_dist.reproduce.job import Task, Training, rooms_needed
from hoz_dist.reproduce.measuring import measure, sample_rooms
from hoz_dist.sim.view_store import ViewStore

_POLL_S: Final = 1.0


def measure_costs(tasks: Sequence[Task], cache: Path, picture_size: int, jobs: int) -> Costs:
    """Do a little of everything, and tell what it cost.

    Args:
        tasks: What is to do.
        cache: The view cache; some rooms are rendered into it.
        picture_size: Side of the pictures, pixels.
        jobs: Processes that will work at once; as many do so now, but no more than there are tasks.

    Raises:
        HozError: The cache cannot be written, or a process failed.
        OwnMistakeError: A process failed without a reason.
    """
    trainings = {task.training.digest: task for task in tasks if task.training is not None}
    samples = [room for task in trainings.values() if task.training for room in sample_rooms(task.training.scenes)]
    missing = missing_rooms(rooms_needed(tasks), cache, picture_size, Encoding())
    # Rooms of one scene are about as large as each other, so one of each tells enough.
    first = [room for room in dict.fromkeys(samples) if room in missing]
    first += {room.scene: room for room in missing if room.scene not in {one.scene for one in first}}.values()
    began = time.monotonic()
    if first:
        render_rooms(first, cache, picture_size, jobs, Encoding())
    seconds = time.monotonic() - began
    of_scene: Mapping[str, int] = {room.scene: sum(one.scene == room.scene for one in missing) for room in first}
    share = statistics.fmean(of_scene.values()) if of_scene else 1.0
    return Costs(
        speeds=_speeds(trainings, cache, min(jobs, len(tasks))) if trainings else {},
        render_seconds=seconds * max(0.0, share - 1.0),
    )


def _speeds(trainings: Mapping[str, Task], cache: Path, jobs: int) -> dict[str, Speed]:
    """Measure each training in as many processes at once as will work, and take the mean."""
    context = multiprocessing.get_context("spawn")
    wanted = [(task.training, task.jobs[0].protocol.test_episodes) for task in trainings.values()]
    workers = [Worker(context, _measure, wanted, cache) for _ in range(jobs)]
    measured: dict[Worker, list[Speed]] = {worker: [] for worker in workers}
    try:
        with Progress("Measuring", len(wanted) * jobs, "measurements") as progress:
            # Those alone that owe something: the connection of one that has ended is always ready.
            while owing := [worker for worker, speeds in measured.items() if len(speeds) < len(wanted)]:
                wait([worker.connection for worker in owing], _POLL_S)
                for worker in owing:
                    status = worker.exit_status
                    for sent in worker.receive():
                        if isinstance(sent, Failure):
                            raise HozError(sent.sentence)
                        measured[worker].append(sent)
                    if status and len(measured[worker]) < len(wanted):
                        if status > 0:
                            raise OwnMistakeError(OUR_MISTAKE)
                        message = "A process that measures was killed, perhaps for want of memory; use fewer --jobs."
                        raise HozError(message)
                progress.update(sum(map(len, measured.values())))
    finally:
        for worker in workers:
            worker.terminate()
        for worker in workers:
            worker.join()
    return {
        digest: Speed(*map(statistics.fmean, zip(*of_training, strict=True)))
        for digest, of_training in zip(trainings, zip(*measured.values(), strict=True), strict=True)
    }


def _measure(wanted: Sequence[tuple[Training, int]], cache: Path, send: Callable[[Any], None]) -> None:
    """Measure one training after the other; the body of a process."""
    use_one_thread()
    for training, episodes in wanted:
        store = ViewStore(cache, training.config.picture_size)
        send(measure(training.config, sample_rooms(training.scenes), store, episodes))
