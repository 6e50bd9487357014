"""The view cache: every room's pictures, rendered once, and what follows from them.

A picture takes about 1.4 ms to render and an index look-up takes a microsecond, so a room is rendered once per machine
and read by all processes through the page cache. A room's folder is named by everything that shapes its pictures; a
change of any of it is another folder.

Writers of one room take turns by a lock file (`flock`: the system frees it when its holder dies), because rendering the
same pictures twice is what would cost. Readers take no lock: a position counts once its checksum is right.
"""

import hashlib
import inspect
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import filelock
import numpy as np
import platformdirs
from numpy.typing import NDArray

from hoz_dist.errors import DamagedFileError, InvalidValueError
from hoz_dist.nav.categories import SCENE_TARGETS, category_index
from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.nav.pose import PICTURE_SIZE, VIEWS_PER_POSITION
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.appearance import appearance
from hoz_dist.sim.catalogue import load_room, recorded_digest
from hoz_dist.sim.detections import Detector
from hoz_dist.sim.painter import Painter
from hoz_dist.sim.pose_graph import PoseGraph
from hoz_dist.sim.room import Room
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_folder import Frames, ViewFolder

FORMAT_VERSION: Final = 1
"""Raised when the files of a room's folder change their meaning."""
Progress = Callable[[int, int], None]
"""Called with the number of views done and the number of all views; with (0, 1) while another process writes the room.

An exception from it ends the work.
"""
_LOCK_POLL_S: Final = 0.2
"""How often a process that waits for another one's lock tells its progress, seconds."""

_PICTURE_SOURCES: Final = (
    "../nav/actions.py",
    "../nav/pose.py",
    "world.py",
    "camera.py",
    "painter.py",
    "pose_graph.py",
)
_DERIVED_SOURCES: Final = ("../nav/episode.py", "../nav/categories.py", "detections.py", "appearance.py")


def default_cache() -> Path:
    """Return the cache folder: ``HOZ_CACHE`` if it is set, else the user's cache folder of this system."""
    return Path(os.environ.get("HOZ_CACHE") or platformdirs.user_cache_dir("hoz-dist"))


def sources_digest(encoder: VisualEncoder) -> str:
    """Tell whether the source texts that shape pictures, and what is derived from them with an encoder, are the same.

    The content of rooms, which `recorded_digest` tells, has no part in it.
    """
    return _short_digest(_sources_digest(_PICTURE_SOURCES), _derived_name(encoder))


class ViewStore:
    """Opens rooms from the view cache and renders what is missing there."""

    def __init__(
        self,
        folder: Path | None = None,
        picture_size: int = PICTURE_SIZE,
        rooms: Callable[[RoomId], Room] | None = None,
    ) -> None:
        """Use a cache folder, which is made when something is first stored in it.

        Args:
            folder: The cache folder; `default_cache` if None.
            picture_size: S, side of the square pictures in pixels.
            rooms: Gives the content of a room; the catalogue if None.
        """
        self._load_room = cache(rooms or load_room)
        self._from_catalogue = rooms is None
        self._opened: dict[RoomId, ViewFolder] = {}
        self._cache = default_cache() if folder is None else folder
        self._size = picture_size

    def open(self, room: RoomId, encoder: VisualEncoder, progress: Progress | None = None) -> RoomViews:
        """Return a room's views as an encoder sees them, rendering and encoding what the cache lacks.

        Args:
            room: The room.
            encoder: Makes the features.
            progress: Told how far rendering is, and while another process holds the room, so that it can stop the
                wait by an exception; not called when nothing is missing.

        Raises:
            InvalidValueError: Something is missing and the cache cannot be written.
        """
        path, name = self._path(room), _derived_name(encoder)
        opened = self._opened_derived(path, name)
        if opened is None:
            content = self._load_room(room)
            with self._writing(path, progress), Painter(content, self._size) as painter:
                folder = self._open_or_create(path, painter)
                # Another process may have been through this while we waited for the lock.
                arrays = folder.load_derived(name)
                if arrays is None:
                    folder.save_derived(name, _derive(folder, painter, content, encoder, progress))
                    arrays = folder.load_derived(name)
            if arrays is None:
                raise _unwritable(self._cache, "what was written could not be read back")
            opened = folder, arrays
        return _room_views(room, self._digest_of(room), *opened)

    def find(self, room: RoomId, encoder: VisualEncoder) -> RoomViews | None:
        """Return a room's views as an encoder sees them if the cache has them all; otherwise None, without delay."""
        opened = self._opened_derived(self._path(room), _derived_name(encoder))
        return None if opened is None else _room_views(room, self._digest_of(room), *opened)

    def holds(self, room: RoomId, encoder: VisualEncoder) -> bool:
        """Tell whether `open` would find all of a room in the cache."""
        return self.find(room, encoder) is not None

    def frames(self, room: RoomId, views: NDArray[np.integer] | None = None) -> Frames:
        """Return pictures, rendering those positions that the cache lacks.

        Args:
            room: The room.
            views: Which views, [M]; all if None.

        Raises:
            InvalidValueError: Something is missing and the cache cannot be written.
        """
        folder = self._folder(room)
        chosen = np.arange(folder.graph.views) if views is None else np.asarray(views)
        position_of, row = np.divmod(chosen, VIEWS_PER_POSITION)
        positions, chunk_of = np.unique(position_of, return_inverse=True)
        chunks = [folder.read(position) for position in positions.tolist()]
        if None in chunks:
            with self._writing(folder.path), Painter(self._load_room(room), self._size) as painter:
                chunks = [_chunk(folder, painter, position) for position in positions.tolist()]
        frames = [chunk for chunk in chunks if chunk is not None]
        return Frames(
            *(
                np.stack([frames[chunk][field][at] for chunk, at in zip(chunk_of.tolist(), row.tolist(), strict=True)])
                for field in range(len(Frames._fields))
            )
        )

    def graph(self, room: RoomId) -> PoseGraph:
        """Return a room's pose graph.

        Raises:
            InvalidValueError: The cache lacks it and cannot be written.
        """
        return self._folder(room).graph

    def _folder(self, room: RoomId) -> ViewFolder:
        """Return a room's folder, opened or made at the first call."""
        if room not in self._opened:
            path = self._path(room)
            try:
                self._opened[room] = ViewFolder.open(path, self._size)
            except DamagedFileError:
                with self._writing(path), Painter(self._load_room(room), self._size) as painter:
                    self._opened[room] = self._open_or_create(path, painter)
        return self._opened[room]

    def _opened_derived(self, path: Path, name: str) -> tuple[ViewFolder, dict[str, NDArray[Any]]] | None:
        """Return a room's folder and what is derived under a name, or None when something is missing or damaged."""
        try:
            folder = ViewFolder.open(path, self._size)
        except DamagedFileError:
            return None
        arrays = folder.load_derived(name)
        return None if arrays is None else (folder, arrays)

    def _open_or_create(self, path: Path, painter: Painter) -> ViewFolder:
        """Open a room's folder, or make it; the caller holds the lock."""
        try:
            return ViewFolder.open(path, self._size)
        except DamagedFileError:
            return ViewFolder.create(path, painter.pose_graph(), self._size)

    def _digest_of(self, room: RoomId) -> str:
        # Making a room takes ten times as long as opening its views; what is in the cache needs its digest alone.
        return recorded_digest(room) if self._from_catalogue else self._load_room(room).digest

    def _path(self, room: RoomId) -> Path:
        """Return the folder for a room's pictures: its name holds the digest of all that shapes them."""
        pybullet = version("pybullet")
        parts = (FORMAT_VERSION, self._digest_of(room), self._size, pybullet, _sources_digest(_PICTURE_SOURCES))
        return self._cache / f"{room.scene}-{room.number}-{_short_digest(*parts)}"

    @contextmanager
    def _writing(self, path: Path, progress: Progress | None = None) -> Iterator[None]:
        """Hold the lock of a room's folder; while it waits for it, it tells ``progress``.

        Raises:
            InvalidValueError: The cache cannot be written.
        """
        try:
            self._cache.mkdir(parents=True, exist_ok=True)
            with _acquired(filelock.FileLock(self._cache / f".{path.name}.lock"), progress):
                yield
        except OSError as error:
            raise _unwritable(self._cache, error.strerror or str(error)) from error


def _room_views(room: RoomId, digest: str, folder: ViewFolder, arrays: dict[str, NDArray[Any]]) -> RoomViews:
    # A room may hold objects that are targets of other scenes only, such as a chair in a bathroom.
    asked_for = {category_index(category) for category in SCENE_TARGETS[room.scene]}
    targets = tuple(target for target in sorted(asked_for) if arrays["success"][:, target].any())
    return RoomViews(room=room, digest=digest, graph=folder.graph, targets=targets, **arrays)


def _acquired(lock: filelock.BaseFileLock, progress: Progress | None) -> AbstractContextManager[object]:
    """Wait for a lock, telling ``progress``; returns what releases it."""
    while True:
        try:
            return lock.acquire(timeout=_LOCK_POLL_S)
        except filelock.Timeout:
            if progress is not None:
                progress(0, 1)


def _chunk(folder: ViewFolder, painter: Painter, position: int) -> Frames:
    """Return the pictures of a position, rendering and storing them if they are missing; the caller holds the lock."""
    stored = folder.read(position)
    if stored is not None:
        return stored
    start = position * VIEWS_PER_POSITION
    frames = painter.paint(folder.graph, range(start, start + VIEWS_PER_POSITION))
    folder.write(position, frames)
    return frames


def _derive(
    folder: ViewFolder, painter: Painter, room: Room, encoder: VisualEncoder, progress: Progress | None
) -> dict[str, NDArray[Any]]:
    """Compute the arrays of `RoomViews` from all pictures of a room, position by position."""
    graph, detector = folder.graph, Detector(room)
    pieces: dict[str, list[NDArray[Any]]] = {"features": [], "detections": [], "appearance": [], "success": []}
    for position in range(len(graph.positions)):
        stop = (position + 1) * VIEWS_PER_POSITION
        frames = _chunk(folder, painter, position)
        features = encoder.encode(frames.rgb, frames.depth.astype(np.float32))
        found = detector.detect(frames.segmentation, graph.places(np.arange(stop - VIEWS_PER_POSITION, stop)))
        pieces["features"].append(features)
        pieces["detections"].append(found.detections)
        pieces["appearance"].append(appearance(features, found.detections))
        pieces["success"].append(found.success)
        if progress is not None:
            progress(stop, graph.views)
    arrays = {name: np.concatenate(chunks) for name, chunks in pieces.items()}
    arrays["optimal"] = np.stack([graph.distances_to(goal) for goal in arrays["success"].T], axis=1)
    return arrays


def _derived_name(encoder: VisualEncoder) -> str:
    """Return the name of what is derived with an encoder: its key made fit for a file, and a digest."""
    readable = "".join(letter if letter.isalnum() else "-" for letter in encoder.key)[:32]
    parts = (encoder.key, _encoder_source(type(encoder)), inspect.getsource(_derive), _sources_digest(_DERIVED_SOURCES))
    return f"{readable}-{_short_digest(*parts)}"


@cache
def _encoder_source(kind: type[VisualEncoder]) -> str:
    """Return the source text of the module that an encoder's class is written in; of one from a prompt, nothing."""
    try:
        return inspect.getsource(sys.modules[kind.__module__])
    except (OSError, TypeError):
        return ""


def _short_digest(*parts: object) -> str:
    return hashlib.blake2b("\n".join(map(str, parts)).encode(), digest_size=8).hexdigest()


@cache
def _sources_digest(names: tuple[str, ...]) -> str:
    """Return a digest of modules' source texts.

    So no constant or line that shapes the result can change without changing the key; a changed comment costs a
    needless rendering, a forgotten version number would cost wrong results.
    """
    here = Path(__file__).parent
    return _short_digest(*((here / name).read_text() for name in names))


def _unwritable(cache: Path, reason: str) -> InvalidValueError:
    message = f"The view cache {cache} cannot be written ({reason}); set HOZ_CACHE to a folder that can be."
    return InvalidValueError(message)
