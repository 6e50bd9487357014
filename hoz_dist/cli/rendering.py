"""Fills the view cache with several processes at once, and draws contact sheets of rooms."""

import multiprocessing
import signal
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.managers import SyncManager
from pathlib import Path
from queue import Empty, Queue
from threading import Event
from typing import Final, NamedTuple

import numpy as np

from hoz_dist.cli.progress import Progress
from hoz_dist.nav.pose import GRID_M, YAWS, Pose
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.encoders import load_encoder
from hoz_dist.sim.view_store import ViewStore

SHEET_COLUMNS: Final = 8
"""Pictures of each room in a contact sheet."""
_SHEET_GAP: Final = 2
"""Pixels between pictures."""
_POLL_S: Final = 0.2


class _Report(NamedTuple):
    room: RoomId
    done: int
    """Views that are ready."""
    total: int


class _StoppedError(Exception):
    """The main process gave up."""


def render_rooms(rooms: Sequence[RoomId], cache: Path, picture_size: int, jobs: int) -> int:
    """Render the views of rooms that the cache lacks, with the default encoder's features.

    Args:
        rooms: The rooms, each once.
        cache: The view cache.
        picture_size: Side of the pictures, pixels.
        jobs: Processes that render at once.

    Returns:
        The number of views of all rooms.

    Raises:
        HozError: The cache cannot be written.
    """
    context = multiprocessing.get_context("spawn")
    with (
        context.Manager() as manager,
        # Ctrl-C reaches every process of the terminal; only this one acts on it, and tells the others.
        ProcessPoolExecutor(
            min(jobs, len(rooms)),
            mp_context=context,
            initializer=signal.signal,
            initargs=(signal.SIGINT, signal.SIG_IGN),
        ) as pool,
    ):
        reports, stop = _channels(manager)
        tasks = [pool.submit(_render_room, room, cache, picture_size, reports, stop) for room in rooms]
        try:
            _show_progress(tasks, reports, len(rooms))
            return sum(task.result() for task in tasks)
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            raise


def write_contact_sheet(rooms: Iterable[RoomId], store: ViewStore, output: Path) -> None:
    """Write a picture with one row for each room: from places all over it, the level view that shows most items.

    Args:
        rooms: The rooms.
        store: The view cache; what it lacks is rendered.
        output: The PNG file to write.

    Raises:
        HozError: The cache cannot be written.
        OSError: The file cannot be written.
    """
    from matplotlib.image import imsave

    rows = []
    for room in rooms:
        graph = store.graph(room)
        places = graph.positions[np.linspace(0, len(graph.positions) - 1, SHEET_COLUMNS).astype(int)] * GRID_M
        views = [graph.view_of(Pose(x, z, yaw, 0)) for x, z in places.tolist() for yaw in YAWS]
        frames = store.frames(room, np.array(views))
        items = np.array([np.unique(picture).size for picture in frames.segmentation]).reshape(-1, len(YAWS))
        best = np.arange(len(items)) * len(YAWS) + items.argmax(axis=1)
        gap = ((0, 0), (0, _SHEET_GAP), (0, _SHEET_GAP), (0, 0))
        rows.append(np.concatenate(list(np.pad(frames.rgb[best], gap, constant_values=255)), axis=1))
    imsave(output, np.concatenate(rows, axis=0))


def _channels(manager: SyncManager) -> tuple["Queue[_Report]", Event]:
    """Make what the processes talk through: reports of progress, and the word to stop."""
    return manager.Queue(), manager.Event()


def _render_room(room: RoomId, cache: Path, picture_size: int, reports: "Queue[_Report]", stop: Event) -> int:
    """Fill the cache for one room, in a process of the pool; returns the number of its views."""

    def report(done: int, total: int) -> None:
        if stop.is_set():
            raise _StoppedError
        reports.put(_Report(room, done, total))

    return ViewStore(cache, picture_size).open(room, load_encoder("pooled"), report).graph.views


def _show_progress(tasks: Sequence["Future[int]"], reports: "Queue[_Report]", rooms: int) -> None:
    """Show reports until all tasks have ended, or one has failed."""
    latest: dict[RoomId, _Report] = {}
    with Progress("Rendering", rooms, "rooms") as progress:
        while True:
            ended = sum(task.done() for task in tasks)
            failed = any(task.done() and task.exception() is not None for task in tasks)
            try:
                report = reports.get(timeout=_POLL_S)
            except Empty:
                if failed or ended == len(tasks):
                    return
                continue
            latest[report.room] = report
            shares = sum(known.done / max(known.total, 1) for known in latest.values())
            views = sum(known.done for known in latest.values())
            progress.update(max(shares, ended), f"{views:,} views  {report.room}")
