"""`hoz-dist bench env`: steps of stored environments, and the opening of rooms."""

import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from hoz_dist.bench.report import Metric
from hoz_dist.bench.timing import Contender, Progress, core_seconds, rate, run_contests
from hoz_dist.nav.actions import Action
from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.encoders.pooled import PooledEncoder
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_store import ViewStore

TRAINING_BATCH: Final = 64
"""The default batch of a run; measured besides the one that is asked for."""
MEAN_ACTIONS: Final = 30
"""Mean length of an episode: one action of so many is Done, the others are drawn alike."""
_STEPS: Final = 256
"""Steps whose actions are drawn beforehand."""


def bench_env(
    names: Sequence[RoomId],
    cache: Path,
    picture_size: int,
    *,
    batch: int,
    seconds: float,
    repeats: int,
    progress: Progress,
) -> dict[str, Metric]:
    """Measure steps per second of a core, and how long a room takes to open by the clock.

    A step includes what the agent perceives: features, boxes and appearance of all categories, and the bag, copied
    out. The limit is a plain copy of as many bytes out of a table of the same size. The limit of opening is reading
    the bytes of the room's arrays. Both find the files in the system's memory: they were opened before.

    Args:
        names: Rooms to step in, which are in the view cache.
        cache: The view cache.
        picture_size: Side of its pictures, pixels.
        batch: Episodes at once.
        seconds: Length of one measurement.
        repeats: Measurements of each figure.
        progress: Told how far the work is.
    """
    encoder = PooledEncoder()
    openers = [partial(_open, cache, picture_size, name, encoder) for name in names]
    rooms = [opener() for opener in openers]
    sizes = tuple(dict.fromkeys((batch, TRAINING_BATCH)))
    contests = [partial(_stepping, rooms, size, seconds) for size in sizes]
    samples = run_contests([*contests, partial(_opening, openers)], repeats, progress)
    steps = {
        _name(size, batch): Metric.of(samples[f"steps, batch {size}"], "steps/s", samples[f"copies, batch {size}"])
        for size in sizes
    }
    return steps | {"room_open_ms": Metric.of(samples["open"], "ms", samples["read"])}


def _name(size: int, batch: int) -> str:
    return "env_steps_per_second" if size == batch else f"env_steps_per_second_b{size}"


def _open(cache: Path, picture_size: int, name: RoomId, encoder: VisualEncoder) -> RoomViews:
    """Open a room as a process does that has not opened it before."""
    return ViewStore(cache, picture_size).open(name, encoder)


@contextmanager
def _stepping(rooms: Sequence[RoomViews], batch: int, seconds: float) -> Iterator[Mapping[str, Contender]]:
    rng = np.random.default_rng(0)
    env = BatchEnv(batch, rng)
    for views in rooms:
        env.add_room(views)
    shares = np.full(len(Action), (1.0 - 1.0 / MEAN_ACTIONS) / (len(Action) - 1))
    shares[Action.DONE] = 1.0 / MEAN_ACTIONS
    actions = rng.choice(len(Action), size=(_STEPS, batch), p=shares)

    observation = env.observe()
    bags = np.empty(observation.detections.shape[:-1], dtype=np.bool_)

    def step() -> None:
        for chosen in actions:
            np.greater(env.observe().detections[..., 4], 0, out=bags)
            env.step(chosen)

    perceived = (observation.features, observation.detections, observation.appearance)
    values = sum(part.size for part in perceived) // batch
    rows = max(sum(views.graph.views for views in rooms), batch)
    table = np.ones((rows, values), dtype=np.float32)
    copied = np.ones((batch, values), dtype=np.float32)
    starts = rng.integers(rows - batch + 1, size=_STEPS).tolist()

    def copy() -> None:
        for start in starts:
            copied[:] = table[start : start + batch]

    yield {
        f"steps, batch {batch}": lambda: rate(step, seconds, core_seconds) * _STEPS * batch,
        f"copies, batch {batch}": lambda: rate(copy, seconds, core_seconds) * _STEPS * batch,
    }


@contextmanager
def _opening(openers: Sequence[Callable[[], RoomViews]]) -> Iterator[Mapping[str, Contender]]:
    files = [_files(opener()) for opener in openers]

    def read(paths: Sequence[Path]) -> None:
        for path in paths:
            path.read_bytes()

    yield {
        "open": lambda: statistics.median(_milliseconds(opener) for opener in openers),
        "read": lambda: statistics.median(_milliseconds(partial(read, paths)) for paths in files),
    }


def _files(views: RoomViews) -> list[Path]:
    """Return the files that hold the arrays of a room, as far as it is stored."""
    arrays = (views.features, views.detections, views.appearance, views.success, views.optimal)
    return [Path(str(array.filename)) for array in arrays if isinstance(array, np.memmap)]


def _milliseconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return 1000 * (time.perf_counter() - start)
