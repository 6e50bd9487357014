"""Training in one process, without Zenoh: the limit of what an actor and a learner can do together."""

import os
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from hoz_dist.config import RunConfig
from hoz_dist.evaluation.loading import matching_encoder
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.policy.threads import use_one_thread
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.view_store import ViewStore
from hoz_dist.stages import StageClock
from learner.graph_store import GraphStore
from learner.optimizer import FlatAdam
from workers.collector import Collector
from workers.preparation import RoomPreparation
from workers.timings import Timings


def train_in_process(
    config: RunConfig,
    rooms: Sequence[RoomId],
    cache: Path,
    weights: Path | None,
    name: str,
    timings: Path,
    *,
    ready: Callable[[], None],
    stopped: Callable[[float], bool],
) -> None:
    """Train as an actor and its learner would, until told to stop.

    Args:
        config: Configuration of the run.
        rooms: Rooms to train in.
        cache: The view cache.
        weights: Weights of the encoder.
        name: Name of the actor; seeds the episodes.
        timings: File that says after each update what its stages took.
        ready: Called before the rooms are got ready.
        stopped: Waits some seconds for the word to stop, and tells whether it came.
    """
    use_one_thread()
    os.setsid()  # as actors have one each: Linux divides processors between sessions first
    clock = StageClock()
    adam = FlatAdam(initial_parameters(config.policy, config.seed), config.learning_rate)
    ready()
    (collector,) = collectors_in(config, rooms, cache, weights, [name], clock)
    frames = 0
    with Timings(timings, clock) as lines:
        while not stopped(0.0):
            with clock("load"):
                collector.load(adam.parameters, adam.updates)
            with clock("act"):
                update = collector.roll_out()
            with clock("apply"):
                adam.step(update.gradient)
            frames += update.frames
            lines.update(frames, rooms_waiting=0)


def collectors_in(
    config: RunConfig,
    rooms: Sequence[RoomId],
    cache: Path,
    weights: Path | None,
    names: Sequence[str],
    clock: StageClock | None = None,
) -> list[Collector]:
    """Make a collector for each of some actors, all in the same rooms, which are explored once.

    Args:
        config: Configuration of the run.
        rooms: Rooms to train in.
        cache: The view cache.
        weights: Weights of the encoder.
        names: Names of the actors; they seed the episodes.
        clock: Measures the stages of all of them; None for none.
    """
    store, encoder = ViewStore(cache, config.picture_size), matching_encoder(config, weights)
    preparation = RoomPreparation(rooms, store, encoder, zones=config.zones, actor=names[0])
    ready = [preparation.next() for _ in rooms]
    graphs = GraphStore(config.zones, {})
    for room in ready:
        graphs.add(room.graph)
    collectors = []
    for name in names:
        rng = np.random.default_rng([config.seed, zlib.crc32(name.encode())])
        env = BatchEnv(config.batch, rng)
        for room in ready:
            env.add_room(room.views)
        collectors.append(Collector(config, env, rng, clock))
        for graph in graphs.scenes.values():
            collectors[-1].use_graph(graph)
    return collectors
