"""Measures, before `hoz-dist reproduce` begins, what the parts of its work will cost, and fills the view cache."""

import multiprocessing
import os
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any, Final

from hoz_dist.cli.progress import Progress
from hoz_dist.cli.rendering import Encoding, render_rooms
from hoz_dist.cli.reproducing.crew import OUR_MISTAKE, Worker
from hoz_dist.errors import HozError, OwnMistakeError
from hoz_dist.nav.rooms import RoomId, training_rooms
from hoz_dist.policy.encoders import load_encoder
from hoz_dist.reproduce.costs import Costs, Speed
from hoz_dist.reproduce.job import Task, Training
from hoz_dist.reproduce.measuring import measure, sample_rooms
from hoz_dist.sim.view_store import ViewStore

_POLL_S: Final = 1.0


def rooms_needed(tasks: Iterable[Task]) -> list[RoomId]:
    """Return the rooms that tasks train, choose and test in, each once."""
    rooms: dict[RoomId, None] = {}
    for task in tasks:
        if task.training is not None:
            rooms |= dict.fromkeys(training_rooms(task.training.scenes))
        for job in task.jobs:
            rooms |= dict.fromkeys((*job.protocol.rooms("val"), *job.protocol.rooms("test")))
    return list(rooms)


def missing_rooms(rooms: Iterable[RoomId], cache: Path, picture_size: int) -> list[RoomId]:
    """Return those rooms that the view cache lacks."""
    store, encoder = ViewStore(cache, picture_size), load_encoder("pooled")
    return [room for room in rooms if not store.holds(room, encoder)]


def render(rooms: Sequence[RoomId], cache: Path, picture_size: int) -> float:
    """Render rooms with every core; returns the seconds that it took."""
    began = time.monotonic()
    if rooms:
        render_rooms(rooms, cache, picture_size, len(os.sched_getaffinity(0)), Encoding())
    return time.monotonic() - began


def measure_costs(tasks: Sequence[Task], cache: Path, picture_size: int, jobs: int) -> Costs:
    """Do a little of everything, and tell what it cost.

    Args:
        tasks: What is to do.
        cache: The view cache; some rooms are rendered into it.
        picture_size: Side of the pictures, pixels.
        jobs: Processes that will work at once; as many do so now.

    Raises:
        HozError: The cache cannot be written, or a process failed.
        OwnMistakeError: A process failed without a reason.
    """
    trainings = {task.training.digest: task for task in tasks if task.training is not None}
    samples = [room for task in trainings.values() if task.training for room in sample_rooms(task.training.scenes)]
    missing = missing_rooms(rooms_needed(tasks), cache, picture_size)
    # Rooms of one scene are about as large as each other, so one of each tells enough.
    first = [room for room in dict.fromkeys(samples) if room in missing]
    first += {room.scene: room for room in missing if room.scene not in {one.scene for one in first}}.values()
    seconds = render(first, cache, picture_size)
    of_scene: Mapping[str, int] = {room.scene: sum(one.scene == room.scene for one in missing) for room in first}
    share = statistics.fmean(of_scene.values()) if of_scene else 1.0
    return Costs(
        speeds=_speeds(trainings, cache, jobs) if trainings else {},
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
                        if not isinstance(sent, Speed):
                            raise HozError(sent.note)
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
    import torch

    torch.set_num_threads(1)
    for training, episodes in wanted:
        store = ViewStore(cache, training.config.picture_size)
        send(measure(training.config, sample_rooms(training.scenes), store, episodes))
