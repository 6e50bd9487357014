"""The runs that are to be analysed: their checkpoints, and the same episodes for all of them."""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hoz_dist.cli.analysing.naming import Training, method_names
from hoz_dist.cli.measure import agent_of, open_benchmark
from hoz_dist.errors import DamagedFileError, InvalidValueError, NotFoundError
from hoz_dist.evaluation.benchmark import Benchmark
from hoz_dist.nav.rooms import Split
from learner.checkpoint import Checkpoint, kept_checkpoints, load_checkpoint


class Run(NamedTuple):
    """A run that is to be analysed."""

    path: Path
    """The run folder or the checkpoint, as the user names it."""
    method: str
    """Its name in tables and pictures; runs that differ by their seed alone share it, see `method_names`."""
    checkpoint: Checkpoint
    kept: tuple[Path, ...]
    """The checkpoints of its curve, by version; none when no curve is wanted."""
    benchmark: Benchmark
    """Its episodes, those of the other runs too, in rooms as its own encoder sees them."""


def open_runs(
    paths: Sequence[Path],
    *,
    split: Split,
    episodes: int,
    scenes: Sequence[str],
    weights: Path | None,
    cache: Path | None,
    with_kept: bool,
) -> list[Run]:
    """Read runs and draw their episodes; what cannot be used is found out here, before hours of episodes.

    Args:
        paths: Run folders or checkpoints, at least one.
        split: Rooms to use.
        episodes: Number of episodes in each scene.
        scenes: Scenes; those that the runs were trained in when there are none.
        weights: Weights of the resnet18 encoder.
        cache: Folder of the view store; the default one when None.
        with_kept: Whether curves are wanted.

    Raises:
        HozError: A run, or a checkpoint of its curve, cannot be used, a run is there twice or keeps no checkpoint, or
            the runs cannot have the same episodes.
    """
    checkpoints = [load_checkpoint(path) for path in paths]
    _refuse_duplicates(paths, checkpoints)
    kept = [_kept(path) if with_kept else () for path in paths]
    names = method_names(paths, [_training(checkpoint) for checkpoint in checkpoints])
    benchmarks = [
        open_benchmark(checkpoint, split=split, episodes=episodes, scenes=scenes, weights=weights, cache=cache)
        for checkpoint in checkpoints
    ]
    for path, benchmark in zip(paths, benchmarks, strict=True):
        if benchmark.episodes != benchmarks[0].episodes:
            message = (
                f"'{paths[0]}' and '{path}' have different episodes, because of their scenes or the size of their "
                "pictures; name common scenes by --scene, or analyse them one by one."
            )
            raise InvalidValueError(message)
    for checkpoint in checkpoints:
        agent_of(checkpoint)
    return [Run(*parts) for parts in zip(paths, names, checkpoints, kept, benchmarks, strict=True)]


def _refuse_duplicates(paths: Sequence[Path], checkpoints: Sequence[Checkpoint]) -> None:
    """Make sure that no agent is there twice, under whatever path: it would count as two seeds of its method.

    Raises:
        InvalidValueError: Two are the same.
    """
    for (path, one), (other_path, other) in combinations(zip(paths, checkpoints, strict=True), 2):
        if one.config == other.config and np.array_equal(one.parameters, other.parameters):
            message = f"'{path}' and '{other_path}' are the same checkpoint; name it once."
            raise InvalidValueError(message)


def _training(checkpoint: Checkpoint) -> Training:
    rooms = frozenset((room.room, room.digest) for room in checkpoint.rooms)
    return Training(checkpoint.config, checkpoint.frames, rooms)


def _kept(path: Path) -> tuple[Path, ...]:
    """Return the checkpoints of a run's curve, all of which can be used.

    Raises:
        InvalidValueError: It is one checkpoint.
        NotFoundError: There is none.
        HozError: One is damaged, or cannot be used or read now.
    """
    if path.is_file():
        message = f"--curve needs run folders, and '{path}' is a file; leave out --curve, or give the run's folder."
        raise InvalidValueError(message)
    kept = kept_checkpoints(path)
    if not kept:
        message = f"'{path}' keeps no checkpoint for a curve; give a run folder that was trained with --keep-every."
        raise NotFoundError(message)
    for file in kept:
        try:
            agent_of(load_checkpoint(file))
        except DamagedFileError as error:
            message = f"--curve needs '{file}', which is damaged; leave out --curve, or delete this file."
            raise DamagedFileError(message) from error
    return kept
