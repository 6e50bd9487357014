"""Training in one process, without Zenoh: the limit of what an actor and a learner can do together."""

import os
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch

from hoz_dist.config import RunConfig
from hoz_dist.evaluation.loading import matching_encoder
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.parameters import initial_parameters
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
    torch.set_num_threads(1)
    os.setsid()  # as actors have one each: Linux divides processors between sessions first
    rng = np.random.default_rng([config.seed, zlib.crc32(name.encode())])
    clock, env = StageClock(), BatchEnv(config.batch, rng)
    collector = Collector(config, env, rng, clock)
    adam = FlatAdam(initial_parameters(config.policy, config.seed), config.learning_rate)
    graphs = GraphStore(config.zones, {})
    encoder = matching_encoder(config, weights)
    preparation = RoomPreparation(rooms, ViewStore(cache, config.picture_size), encoder, zones=config.zones, actor=name)
    ready()
    while preparation.waiting:
        room = preparation.next()
        graphs.add(room.graph)
        env.add_room(room.views)
    for graph in graphs.scenes.values():
        collector.use_graph(graph)
    frames = 0
    with Timings(timings, clock) as lines:
        while not stopped(0.0):
            with clock("load"):
                collector.parameters.load(adam.parameters)
            with clock("act"):
                update = collector.roll_out()
            with clock("apply"):
                adam.step(update.gradient)
            frames += update.frames
            lines.update(frames, rooms_waiting=0)
