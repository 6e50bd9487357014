"""Measures what the parts of the work cost, by doing a little of each in this process."""

import time
from collections.abc import Sequence
from typing import Final

import numpy as np

from hoz_dist.config import RunConfig
from hoz_dist.evaluation.loading import load_agent, matching_encoder
from hoz_dist.evaluation.protocol import EPISODE_SEED
from hoz_dist.nav.rooms import RoomId, training_rooms
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.reproduce.costs import Speed
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.episode_runner import EpisodeRunner
from hoz_dist.sim.episodes import episode_list
from hoz_dist.sim.view_store import ViewStore
from learner.graph_store import GraphStore
from learner.optimizer import FlatAdam
from workers.collector import Collector
from workers.preparation import RoomPreparation

WARM_UP_UPDATES: Final = 2
TRAINING_S: Final = 2.5
"""How long training is measured."""
STEPS: Final = 4
"""Steps of a trial that are measured, after one that warms up."""


def sample_rooms(scenes: Sequence[str]) -> tuple[RoomId, ...]:
    """Return the first training room of each scene among some scenes or rooms: those that are measured in."""
    return tuple({room.scene: room for room in reversed(training_rooms(tuple(scenes)))}.values())


def measure(config: RunConfig, rooms: Sequence[RoomId], store: ViewStore, episodes: int) -> Speed:
    """Train and test for some seconds.

    Args:
        config: Configuration of the run.
        rooms: Rooms to do so in; the view cache has them.
        store: The view cache.
        episodes: Episodes of a trial.
    """
    rng = np.random.default_rng(config.seed)
    env = BatchEnv(config.batch, rng)
    collector = Collector(config, env, rng)
    adam = FlatAdam(initial_parameters(config.policy, config.seed), config.learning_rate)
    graphs = GraphStore(config.zones, {}, merging=config.merging)
    encoder = matching_encoder(config, None)
    preparation = RoomPreparation(
        rooms, store, encoder, zones=config.zones, clustering=config.clustering, actor="measuring"
    )
    views = []
    while preparation.waiting:
        room = preparation.next()
        graphs.add(room.graph)
        env.add_room(room.views)
        views.append(room.views)
    for graph in graphs.scenes.values():
        collector.use_graph(graph)

    def update() -> int:
        made = collector.roll_out()
        adam.step(made.gradient)
        collector.load(adam.parameters, adam.updates)
        return made.frames

    for _ in range(WARM_UP_UPDATES):
        update()
    frames, began = 0, time.perf_counter()
    while (elapsed := time.perf_counter() - began) < TRAINING_S:
        frames += update()

    agent = load_agent(config, np.asarray(adam.parameters), graphs.scenes)
    runner = EpisodeRunner(views, episode_list(views, episodes, EPISODE_SEED))
    agent.begin(runner, rng)
    runner.step(agent.act(runner))
    began = time.perf_counter()
    for _ in range(STEPS):
        runner.step(agent.act(runner))
    return Speed(frames / elapsed, (time.perf_counter() - began) / (STEPS * episodes))
