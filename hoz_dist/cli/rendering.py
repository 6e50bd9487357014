"""Fills the view cache with several processes at once, and draws contact sheets of rooms."""

import io
import multiprocessing
import os
import signal
from collections.abc import Iterable, Sequence
from multiprocessing.process import BaseProcess
from multiprocessing.queues import Queue, SimpleQueue
from pathlib import Path
from queue import Empty
from typing import Final, NamedTuple

import numpy as np

from hoz_dist.cli.child import die_with_parent
from hoz_dist.cli.progress import Progress
from hoz_dist.cli.spawning import start_shielded
from hoz_dist.errors import HozError, InvalidValueError
from hoz_dist.nav.pose import GRID_M, YAWS, Pose
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.encoders import load_encoder
from hoz_dist.policy.settings import EncoderName
from hoz_dist.sim.view_store import ViewStore

SHEET_COLUMNS: Final = 8
"""Pictures of each room in a contact sheet."""
_SHEET_GAP: Final = 2
"""Pixels between pictures."""
_POLL_S: Final = 0.2


class _Report(NamedTuple):
    """What a rendering process says of a room."""

    room: RoomId
    done: int = 0
    """Views that are ready."""
    total: int = 0
    cached: bool = False
    """Whether the cache had them all."""
    ended: bool = False
    error: str = ""
    """Why the room cannot be rendered; empty when it can."""


class Encoding(NamedTuple):
    """Which visual encoder's features are stored with the pictures."""

    name: EncoderName = "pooled"
    weights: Path | None = None


def render_rooms(rooms: Sequence[RoomId], cache: Path, picture_size: int, jobs: int, encoding: Encoding) -> int:
    """Render the views of rooms that the cache lacks, with an encoder's features.

    Args:
        rooms: The rooms, each once, at least one.
        cache: The view cache.
        picture_size: Side of the pictures, pixels.
        jobs: Processes that render at once.
        encoding: The encoder.

    Returns:
        The number of views of all rooms.

    Raises:
        HozError: The cache cannot be written, or a process was killed.
    """
    context = multiprocessing.get_context("spawn")
    tasks: SimpleQueue[RoomId | None] = context.SimpleQueue()
    reports: Queue[_Report] = context.Queue()
    count = min(jobs, len(rooms))
    for task in [*rooms, *[None] * count]:
        tasks.put(task)
    arguments = (os.getpid(), tasks, reports, cache, picture_size, encoding)
    workers = [context.Process(target=_render, args=arguments, daemon=True) for _ in range(count)]
    start_shielded(workers)
    try:
        return _follow(workers, reports, len(rooms))
    finally:
        # Whatever ends this, rendering ends with it: the store takes no harm when a process is killed.
        for worker in workers:
            worker.terminate()
        for worker in workers:
            worker.join()


def missing_rooms(rooms: Iterable[RoomId], cache: Path, picture_size: int, encoding: Encoding) -> list[RoomId]:
    """Return those rooms of which the view cache lacks something.

    Args:
        rooms: The rooms.
        cache: The view cache.
        picture_size: Side of the pictures, pixels.
        encoding: The encoder.

    Raises:
        HozError: The encoder cannot be loaded.
    """
    encoder, store = load_encoder(*encoding), ViewStore(cache, picture_size)
    return [room for room in rooms if not store.holds(room, encoder)]


def render_missing(rooms: Iterable[RoomId], cache: Path, picture_size: int, jobs: int, encoding: Encoding) -> None:
    """Do as `render_rooms` does, but start no process for rooms that the cache has.

    Args:
        rooms: The rooms, each once.
        cache: The view cache.
        picture_size: Side of the pictures, pixels.
        jobs: Processes that render at once.
        encoding: The encoder.

    Raises:
        HozError: The cache cannot be written, a process was killed, or the encoder cannot be loaded.
    """
    missing = missing_rooms(rooms, cache, picture_size, encoding)
    if missing:
        render_rooms(missing, cache, picture_size, jobs, encoding)


def contact_sheet(rooms: Iterable[RoomId], store: ViewStore) -> bytes:
    """Draw a picture with one row for each room: from places all over it, the level view that shows most items.

    Args:
        rooms: The rooms.
        store: The view cache; what it lacks is rendered.

    Returns:
        The content of a PNG file.

    Raises:
        HozError: The cache cannot be written.
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
    file = io.BytesIO()
    imsave(file, np.concatenate(rows, axis=0), format="png")
    return file.getvalue()


def _render(
    parent: int,
    tasks: "SimpleQueue[RoomId | None]",
    reports: "Queue[_Report]",
    cache: Path,
    picture_size: int,
    encoding: Encoding,
) -> None:
    """Fill the cache for one room after another; the body of a rendering process."""
    # A parent that is killed ends nobody. Nor could this process end by itself: it holds the reading end of its own
    # reports, and would wait for ever for somebody to read them. The store takes no harm from a SIGKILL.
    die_with_parent(parent, signal.SIGKILL)
    encoder, store = load_encoder(*encoding), ViewStore(cache, picture_size)
    while (room := tasks.get()) is not None:
        rendered = False

        def report(done: int, total: int, room: RoomId = room) -> None:
            nonlocal rendered
            rendered = True
            reports.put(_Report(room, done, total))

        try:
            views = store.open(room, encoder, report).graph.views
        except HozError as error:
            reports.put(_Report(room, ended=True, error=str(error)))
        else:
            reports.put(_Report(room, views, views, cached=not rendered, ended=True))


def _follow(workers: Sequence[BaseProcess], reports: "Queue[_Report]", rooms: int) -> int:
    """Show progress until all rooms have ended; returns the number of their views.

    Raises:
        HozError: A room cannot be rendered, or a process was killed.
    """
    latest: dict[RoomId, _Report] = {}
    with Progress("Rendering", 0, "views") as progress:
        while sum(report.ended for report in latest.values()) < rooms:
            try:
                report = reports.get(timeout=_POLL_S)
            except Empty:
                if any(worker.exitcode not in {None, 0} for worker in workers):
                    # Commands without --jobs render, too, and those that have it may mean runs by it.
                    message = (
                        "A rendering process was killed, perhaps for want of memory; render one room at a time by "
                        "'hoz-dist scenes render --jobs 1', which keeps what is ready, and try again."
                    )
                    raise InvalidValueError(message) from None
                continue
            if report.error:
                raise InvalidValueError(report.error)
            latest[report.room] = report
            rendering = [known for known in latest.values() if not known.cached]
            if rendering:
                done = sum(known.done for known in rendering)
                total = sum(known.total for known in rendering)
                # Rooms that were not opened yet count as the average of those that were.
                total += total * (rooms - len(latest)) // len(rendering)
                progress.update(done, str(report.room), total=total)
    return sum(report.total for report in latest.values())
