"""Checkpoints: one safetensors file each, written atomically, with a digest that tells damage.

The tensors are ``parameters``, ``adam.first_moment``, ``adam.second_moment`` and, per known room,
``rooms/kitchen/3/nodes`` and ``.../edges``. Everything else is JSON in the file's metadata under ``hoz``; ``digest`` is
XXH3-128 over that JSON and all tensors. Nothing in a checkpoint is ever executed.

The name says where in the run it belongs: ``0002-000000123`` is version 123 of epoch 2. A checkpoint of a later epoch
comes after all of an earlier one, also when its version is lower: what came in between was lost with its learner.
"""

import errno
import json
import logging
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import xxhash
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save_file

from hoz_dist.atomic import replace_file
from hoz_dist.config import RunConfig
from hoz_dist.errors import DamagedFileError, HozError, InvalidValueError, NotFoundError
from hoz_dist.gradient_forms import Vector
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from learner.optimizer import AdamState

FORMAT: Final = 1
"""Version of the format; a file of another version is refused by name."""
FOLDER: Final = "checkpoints"
"""Where a run folder keeps them."""
SUFFIX: Final = ".safetensors"
KEPT_SUFFIX: Final = ".keep"
"""An empty file of this suffix beside a checkpoint says that it is never deleted."""
NEWEST_KEPT: Final = 3
_STEM: Final = re.compile(r"([0-9]{4,})-([0-9]{9,})")

_log = logging.getLogger(__name__)


class UnreadableError(HozError):
    """The system cannot read a file now, which says nothing of what is in it.

    Args:
        path: What was read.
        error: What the system says.
    """

    def __init__(self, path: Path, error: OSError) -> None:
        super().__init__(
            f"Cannot read '{error.filename or path}' ({error.strerror or error}); "
            "mend the disk or the rights, and start again."
        )


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Make an `UnreadableError` of an `OSError`.

    Args:
        path: What is read.
    """
    try:
        yield
    except OSError as error:
        raise UnreadableError(path, error) from error


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkpoint:
    """All that a run needs to go on, and an evaluation to begin."""

    config: RunConfig
    epoch: int
    version: int
    """Version of the parameters: number of updates applied in all epochs."""
    frames: int
    episodes: int
    seconds: float
    """Training time so far."""
    parameters: Vector
    """[P]."""
    adam: AdamState
    rooms: tuple[RoomGraph, ...]
    """The known room graphs."""
    graph_versions: Mapping[str, int]
    """Version of each scene graph."""
    recent: tuple[tuple[str, bool], ...]
    """(scene, success) of the last episodes."""
    seen: list[list[object]]
    """The table that tells repeated pushes."""

    @property
    def file_name(self) -> str:
        """What its file is called in a folder of checkpoints."""
        return f"{self.epoch:04d}-{self.version:09d}{SUFFIX}"

    def scene_graphs(self) -> dict[str, SceneGraph]:
        """Return the scene graphs, rebuilt from the room graphs."""
        scenes: dict[str, list[RoomGraph]] = {}
        for room in self.rooms:
            scenes.setdefault(room.room.partition("/")[0], []).append(room)
        merge = self.config.merging.scene_graph
        return {scene: merge(scene, rooms, self.graph_versions[scene]) for scene, rooms in scenes.items()}


class Files(Protocol):
    """How the files of a run are changed: as `Leadership` does, which fails for a learner that no longer leads."""

    def replace(self, path: Path, write: Callable[[Path], object]) -> None:
        """Make or replace a file, as `replace_file` does."""

    def remove(self, path: Path) -> None:
        """Delete a file, if it is there."""


class _OwnFiles:
    """Files of a folder that no other process changes."""

    def replace(self, path: Path, write: Callable[[Path], object]) -> None:
        replace_file(path, write)

    def remove(self, path: Path) -> None:
        path.unlink(missing_ok=True)


OWN_FILES: Final[Files] = _OwnFiles()


class Stamp(NamedTuple):
    """Where in a run a checkpoint belongs; later ones are greater."""

    epoch: int
    version: int

    @classmethod
    def of(cls, path: Path) -> "Stamp | None":
        """Return what the name of a file says; None when it is not that of a checkpoint."""
        match = _STEM.fullmatch(path.stem)
        return cls(int(match[1]), int(match[2])) if match and path.suffix == SUFFIX else None


def save_checkpoint(folder: Path, checkpoint: Checkpoint, *, keep: bool = False, files: Files = OWN_FILES) -> Path:
    """Write a checkpoint atomically, then delete all but the newest `NEWEST_KEPT` and those to keep.

    Args:
        folder: The folder of checkpoints; made when it is not there.
        checkpoint: What to write.
        keep: Never delete this one to make room for newer ones.
        files: How to change the files of the folder.

    Returns:
        The file, named by epoch and version.

    Raises:
        DeposedError: Another learner leads the run by now; nothing has changed.
        OSError: It could not be written; older checkpoints are untouched.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tensors = _tensors_of(checkpoint)
    text = json.dumps(_values_of(checkpoint), sort_keys=True)
    metadata = {"hoz": text, "digest": _digest(text, tensors)}
    path = folder / checkpoint.file_name
    try:
        files.replace(path, lambda temporary: save_file(tensors, temporary, metadata))
    except SafetensorError as error:
        message = f"cannot write the checkpoint '{path}': {error}"
        raise OSError(message) from error
    if keep:
        files.replace(path.with_suffix(KEPT_SUFFIX), Path.touch)
    _prune(folder, files)
    return path


def load_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint.

    Args:
        path: A checkpoint; or a run folder, for its newest checkpoint that can be read, with warnings for damaged ones.

    Raises:
        NotFoundError: There is no such file, or no checkpoint in the folder.
        DamagedFileError: The file, or every checkpoint of the folder, is damaged or something else.
        UnreadableError: The system cannot read it now; nobody knows whether it is damaged.
        InvalidValueError: The checkpoint is of another version of the format, or of hoz-dist.
    """
    with reading(path):
        if not path.is_dir():
            return _load_file(path)
        folder = _folder_of(path)
    checkpoint, damaged = newest_readable(folder)
    for failure in damaged.values():
        _log.warning("%s", failure)
    return checkpoint


def newest_readable(
    folder: Path, read: Callable[[Path], Checkpoint] | None = None
) -> tuple[Checkpoint, dict[Path, DamagedFileError]]:
    """Read the newest checkpoint of a folder that is not damaged.

    Args:
        folder: The folder of checkpoints.
        read: Reads one file, when it is not to be `load_checkpoint`.

    Returns:
        The checkpoint; and the newer ones that are damaged, with what is wrong with each.

    Raises:
        NotFoundError: There is no checkpoint in the folder.
        DamagedFileError: Every checkpoint is damaged or something else.
        UnreadableError: The folder, or a checkpoint newer than all that can be read, cannot be read now.
        InvalidValueError: The newest that is not damaged is of another version of the format, or of hoz-dist.
    """
    with reading(folder):
        files = checkpoint_files(folder)
    if not files:
        message = f"There is no checkpoint in '{folder}'; give a checkpoint file or the folder of a run that saved one."
        raise NotFoundError(message)
    damaged: dict[Path, DamagedFileError] = {}
    for file in files:
        try:
            with reading(file):
                return (read or _load_file)(file), damaged
        except DamagedFileError as error:
            damaged[file] = error
        except NotFoundError as error:
            # Deleted since the folder was read. To go on with an older one would throw away what came after it.
            raise UnreadableError(file, FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))) from error
    message = f"None of the {len(files)} checkpoints in '{folder}' can be read; the newest is '{files[0].name}'."
    raise DamagedFileError(message)


def checkpoint_files(folder: Path) -> list[Path]:
    """Return the checkpoints of a folder, the newest first; none when there is no such folder.

    Raises:
        OSError: The folder cannot be read.
    """
    return [file for _, file in _stamped(folder)]


def kept_checkpoints(run: Path, *, with_newest: bool = False) -> tuple[Path, ...]:
    """Return the checkpoints that a run folder keeps for ever, in the order of the training.

    Each version is there once, though each learner that opens a finished run keeps its end anew; and what a later epoch
    did not go on from is left out.

    Args:
        run: The run folder, or its folder of checkpoints.
        with_newest: Also the newest, which is not marked when everything was killed right after it was written.

    Raises:
        UnreadableError: The folder cannot be read now.
    """
    kept: list[tuple[Stamp, Path]] = []
    with reading(run):
        for stamp, file in _stamped(_folder_of(run)):  # the newest first
            wanted = file.with_suffix(KEPT_SUFFIX).exists() or (with_newest and not kept)
            if wanted and (not kept or stamp.version < kept[-1][0].version):
                kept.append((stamp, file))
    return tuple(file for _, file in reversed(kept))


def _folder_of(run: Path) -> Path:
    """Return the folder of checkpoints of a run; the folder itself when there is none in it."""
    return run / FOLDER if (run / FOLDER).is_dir() else run


def _stamped(folder: Path) -> list[tuple[Stamp, Path]]:
    """Return the checkpoints of a folder and where in the run they belong, the newest first."""
    try:
        # Not by `glob`, for which a folder that it may not read is an empty one.
        stamped = [(Stamp.of(file), file) for file in folder.iterdir()]
    except FileNotFoundError:
        return []
    return sorted(((stamp, file) for stamp, file in stamped if stamp is not None), reverse=True)


def _prune(folder: Path, files: Files) -> None:
    """Delete what is too old."""
    droppable: list[Path] = []
    kept: set[int] = set()
    for stamp, file in _stamped(folder):
        # A run that is over is saved again, to be kept, at the same version by each learner that opens it.
        if file.with_suffix(KEPT_SUFFIX).exists() and stamp.version not in kept:
            kept.add(stamp.version)
        else:
            droppable.append(file)
    for file in droppable[NEWEST_KEPT:]:
        files.remove(file)
        files.remove(file.with_suffix(KEPT_SUFFIX))


def _tensors_of(checkpoint: Checkpoint) -> dict[str, NDArray[Any]]:
    tensors: dict[str, NDArray[Any]] = {
        "parameters": checkpoint.parameters,
        "adam.first_moment": checkpoint.adam.first_moment,
        "adam.second_moment": checkpoint.adam.second_moment,
    }
    for room in checkpoint.rooms:
        tensors[f"rooms/{room.room}/nodes"] = room.nodes
        tensors[f"rooms/{room.room}/edges"] = room.edges
    # safetensors writes the memory as it lies, so it must lie in order.
    return {name: np.ascontiguousarray(tensor) for name, tensor in tensors.items()}


def _values_of(checkpoint: Checkpoint) -> dict[str, object]:
    return {
        "format": FORMAT,
        "config": checkpoint.config.to_json(),
        "epoch": checkpoint.epoch,
        "version": checkpoint.version,
        "frames": checkpoint.frames,
        "episodes": checkpoint.episodes,
        "seconds": checkpoint.seconds,
        "adam_steps": checkpoint.adam.steps,
        "rooms": [[room.room, room.digest] for room in checkpoint.rooms],
        "graph_versions": dict(checkpoint.graph_versions),
        "recent": [[scene, success] for scene, success in checkpoint.recent],
        "seen": checkpoint.seen,
    }


def _digest(text: str, tensors: Mapping[str, NDArray[Any]]) -> str:
    digest = xxhash.xxh3_128(text.encode())
    for name in sorted(tensors):
        tensor = tensors[name]
        digest.update(f"{name} {tensor.dtype.str} {tensor.shape}".encode())
        digest.update(np.ascontiguousarray(tensor).data)
    return digest.hexdigest()


def _load_file(path: Path) -> Checkpoint:
    try:
        # As a whole, and not mapped into memory, where a disk that fails ends the process.
        content = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError) as error:
        message = f"There is no checkpoint '{path}'; give a checkpoint file or the folder of a run."
        raise NotFoundError(message) from error
    except OSError as error:
        raise UnreadableError(path, error) from error
    try:
        tensors = load(content)
        metadata = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")]).get("__metadata__", {})
        text = metadata["hoz"]
        if metadata["digest"] != _digest(text, tensors):
            message = "the digest does not match"
            raise ValueError(message)  # noqa: TRY301 - one handler for all kinds of damage
        values = json.loads(text)
    except (SafetensorError, ValueError, KeyError) as error:
        message = f"'{path}' is damaged or not a checkpoint of hoz-dist ({error}); use another checkpoint of the run."
        raise DamagedFileError(message) from error
    if values["format"] != FORMAT:
        message = f"'{path}' has checkpoint format {values['format']}; this version of hoz-dist reads format {FORMAT}."
        raise InvalidValueError(message)
    try:
        config = RunConfig.from_json(values["config"])
    except HozError as error:
        message = f"'{path}' cannot be used: {error}"
        raise InvalidValueError(message) from error
    return _checkpoint_of(config, values, tensors)


def _checkpoint_of(config: RunConfig, values: Mapping[str, Any], tensors: Mapping[str, NDArray[Any]]) -> Checkpoint:
    """Put a checkpoint together; the digest has vouched for the parts."""
    return Checkpoint(
        config=config,
        epoch=values["epoch"],
        version=values["version"],
        frames=values["frames"],
        episodes=values["episodes"],
        seconds=values["seconds"],
        parameters=tensors["parameters"],
        adam=AdamState(values["adam_steps"], tensors["adam.first_moment"], tensors["adam.second_moment"]),
        rooms=tuple(
            RoomGraph(room, digest, tensors[f"rooms/{room}/nodes"], tensors[f"rooms/{room}/edges"])
            for room, digest in values["rooms"]
        ),
        graph_versions=values["graph_versions"],
        recent=tuple((scene, success) for scene, success in values["recent"]),
        seen=values["seen"],
    )
