"""The files of one room in the view cache: pictures in chunks with checksums, and arrays derived from them.

    header.json               what the folder holds, with the digests of the pose graph's files; written with the folder
    positions.npy, transitions.npy
    rgb.npy                   u8 [V, S, S, 3]
    depth.npy                 f16 [V, S, S]
    segmentation.npy          u8 [V, S, S]
    checksums.npy             u64 [P], of the 16 views of a position; 0: not rendered yet
    <encoder>.json            digests of the arrays derived with that encoder; written after them
    <encoder>.<array>.npy

Nothing here is trusted: what does not match its checksum counts as missing and is made again.
"""

import json
import shutil
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple, Self, TypeVar

import numpy as np
import xxhash
from numpy.typing import DTypeLike, NDArray

from hoz_dist.atomic import remove_left_overs, replace_file
from hoz_dist.errors import DamagedFileError
from hoz_dist.nav.pose import VIEWS_PER_POSITION
from hoz_dist.sim.pose_graph import PoseGraph

_HEADER: Final = "header.json"
_CHECKSUMS: Final = "checksums.npy"
_GRAPH_FILES: Final = ("positions", "transitions")
DERIVED: Final = ("features", "detections", "appearance", "success", "optimal")
"""Names of the arrays that are derived from all pictures of a room, as in `hoz_dist.sim.room_views.RoomViews`."""
_DTYPES: Final = {"rgb": np.uint8, "depth": np.float16, "segmentation": np.uint8}
_Array = NDArray[Any]
_Map = np.memmap[Any, Any]
_Content = TypeVar("_Content")


class Frames(NamedTuple):
    """Pictures of M views."""

    rgb: NDArray[np.uint8]
    """Colours, [M, S, S, 3]."""
    depth: NDArray[np.float16]
    """Distance along the viewing axis, metres, [M, S, S]."""
    segmentation: NDArray[np.uint8]
    """Index of the room's item plus 1, 0 where there is nothing, [M, S, S]."""

    @classmethod
    def empty(cls, count: int, size: int) -> "Frames":
        """Make room for ``count`` pictures of side ``size``."""
        return cls(**{name: np.empty((count, *shape), _DTYPES[name]) for name, shape in _picture_shapes(size).items()})


class ViewFolder:
    """One room's folder, opened; reading needs no write access."""

    def __init__(self, path: Path, graph: PoseGraph, frames: Mapping[str, _Map], checksums: _Map) -> None:
        """Use `open` or `create`."""
        self.path = path
        self.graph = graph
        self._frames = frames
        self._checksums = checksums

    @classmethod
    def open(cls, path: Path, size: int | None = None) -> Self:
        """Open a folder.

        Args:
            path: The folder.
            size: S, side of its pictures; any if None.

        Raises:
            DamagedFileError: The folder is not there, or its header, its pose graph, or the length, type or shape of
                an array is wrong.
        """
        digests = _read(_json, path / _HEADER)
        graph = PoseGraph(*(np.array(_read(_array, path / f"{name}.npy")) for name in _GRAPH_FILES))
        if digests != _graph_digests(graph):
            raise _damaged(path)
        frames = {name: _read(_array, path / f"{name}.npy") for name in Frames._fields}
        checksums = _read(_array, path / _CHECKSUMS)
        whole = _is(checksums, np.uint64, (len(graph.positions),))
        side = (0, *frames["segmentation"].shape)[-1] if size is None else size
        for name, shape in _picture_shapes(side).items():
            whole = whole and _is(frames[name], _DTYPES[name], (graph.views, *shape))
        if not whole:
            raise _damaged(path)
        return cls(path, graph, frames, checksums)

    @classmethod
    def create(cls, path: Path, graph: PoseGraph, size: int) -> Self:
        """Make a folder without pictures in place of what is there; the caller holds the room's lock.

        It is filled under a temporary name and renamed, so that no reader meets half a folder.

        Raises:
            OSError: The cache cannot be written.
        """
        building = path.with_name(f".{path.name}.new")
        shutil.rmtree(building, ignore_errors=True)
        building.mkdir()
        for name in _GRAPH_FILES:
            np.save(building / f"{name}.npy", getattr(graph, name))
        np.save(building / _CHECKSUMS, np.zeros(len(graph.positions), dtype=np.uint64))
        for name, shape in _picture_shapes(size).items():
            # Sparse: pictures take disk space as they are rendered.
            np.lib.format.open_memmap(building / f"{name}.npy", "w+", _DTYPES[name], (graph.views, *shape))
        (building / _HEADER).write_text(json.dumps(_graph_digests(graph)))
        if path.exists():
            discarded = path.with_name(f".{path.name}.old")
            shutil.rmtree(discarded, ignore_errors=True)
            path.rename(discarded)
            shutil.rmtree(discarded, ignore_errors=True)
        building.rename(path)
        return cls.open(path, size)

    def read(self, position: int) -> Frames | None:
        """Return the pictures of a position's 16 views, or None when they are not there or damaged."""
        start = position * VIEWS_PER_POSITION
        rows = slice(start, start + VIEWS_PER_POSITION)
        frames = Frames(**{name: np.asarray(array[rows]) for name, array in self._frames.items()})
        return frames if _frames_digest(frames) == self._checksums[position] else None

    def write(self, position: int, frames: Frames) -> None:
        """Store the pictures of a position's 16 views; the caller holds the room's lock.

        Written with write(2) rather than through the map: a full disk is then an error, not a SIGBUS.

        Raises:
            OSError: The cache cannot be written.
        """
        for name, new in frames._asdict().items():
            _overwrite(self._frames[name], position * new.nbytes, new)
        checksum = np.array([_frames_digest(frames)], dtype=np.uint64)
        _overwrite(self._checksums, position * checksum.nbytes, checksum)

    def load_derived(self, name: str) -> dict[str, _Array] | None:
        """Return the arrays `DERIVED` under a name, memory-mapped, or None when they are not there or damaged."""
        try:
            digests = _read(_json, self.path / f"{name}.json")
            arrays = {array_name: _read(_array, self.path / f"{name}.{array_name}.npy") for array_name in DERIVED}
        except DamagedFileError:
            return None
        return dict(arrays) if digests == _digests(arrays) else None

    def save_derived(self, name: str, arrays: Mapping[str, _Array]) -> None:
        """Store the arrays `DERIVED` under a name, their digests last; the caller holds the room's lock.

        Raises:
            OSError: The cache cannot be written.
        """
        remove_left_overs(self.path)
        for array_name, array in arrays.items():
            replace_file(self.path / f"{name}.{array_name}.npy", partial(_save, array))
        digests = json.dumps(_digests(arrays))
        replace_file(self.path / f"{name}.json", lambda temporary: temporary.write_text(digests))


def _damaged(path: Path) -> DamagedFileError:
    return DamagedFileError(f"{path} in the view cache is missing or damaged.")


def _picture_shapes(size: int) -> dict[str, tuple[int, ...]]:
    return {"rgb": (size, size, 3), "depth": (size, size), "segmentation": (size, size)}


def _read(read: Callable[[Path], _Content], path: Path) -> _Content:
    """Read a file that may be missing or damaged.

    Raises:
        DamagedFileError: Whatever goes wrong. NumPy's parser of headers hands over what Python's tokenizer, parser and
            `mmap` make of damage: SyntaxError, TokenError, ValueError, OverflowError, MemoryError, ...
    """
    try:
        return read(path)
    except Exception as error:
        raise _damaged(path) from error


def _json(path: Path) -> object:
    content: object = json.loads(path.read_text())
    return content


def _array(path: Path) -> _Map:
    """Map an array's file; what its header only warns of is damage as well, since the store wrote it."""
    with warnings.catch_warnings(action="error"):
        return np.lib.format.open_memmap(path, "r")


def _save(array: _Array, path: Path) -> None:
    with path.open("wb") as file:
        np.save(file, array)


def _is(array: _Map, dtype: DTypeLike, shape: tuple[int, ...]) -> bool:
    """Tell whether an array has exactly this type, byte order included, and shape, and lies row by row."""
    return array.dtype == np.dtype(dtype) and array.shape == shape and array.flags.c_contiguous


def _overwrite(array: _Map, offset: int, rows: _Array) -> None:
    """Write rows into an array's file, ``offset`` bytes behind its first row."""
    with Path(str(array.filename)).open("r+b") as file:
        file.seek(array.offset + offset)
        file.write(np.ascontiguousarray(rows).data)


def _digest(array: _Array) -> str:
    return f"{array.dtype.str}{list(array.shape)} {xxhash.xxh3_64_hexdigest(np.ascontiguousarray(array).data)}"


def _digests(arrays: Mapping[str, _Array]) -> dict[str, str]:
    return {name: _digest(array) for name, array in arrays.items()}


def _graph_digests(graph: PoseGraph) -> dict[str, str]:
    return _digests({name: getattr(graph, name) for name in _GRAPH_FILES})


def _frames_digest(frames: Frames) -> int:
    """Return the checksum of a position's pictures, never 0."""
    hasher = xxhash.xxh3_64()
    for array in frames:
        hasher.update(np.ascontiguousarray(array).data)
    return hasher.intdigest() or 1
