"""Actors' rollouts in rooms made by hand."""

import dataclasses

import numpy as np

from hoz_dist.config import RunConfig
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph, merge_rooms
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.room_views import RoomViews
from tests.unit.sim.making import random_views
from workers.collector import Collector

CONFIG = RunConfig(batch=6, rollout_steps=8)
KITCHEN, BEDROOM = RoomId("kitchen", 1), RoomId("bedroom", 2)


def scene_graph(scene: str, seed: int, version: int = 1) -> SceneGraph:
    rng = np.random.default_rng(seed)
    edges = rng.random((CONFIG.zones, CONFIG.zones)) * 0.3
    edges = (edges + edges.T) / 2
    np.fill_diagonal(edges, 1.0)
    nodes = rng.random((CONFIG.zones, len(TARGETS)))
    return merge_rooms(scene, [RoomGraph(f"{scene}/1", "0" * 32, nodes, edges)], version=version)


def room_views(room: RoomId, seed: int = 0, config: RunConfig = CONFIG) -> RoomViews:
    """Views with features of the run's encoder, of content ``d1``."""
    views = random_views(room, seed=seed)
    rng = np.random.default_rng(seed + 100)
    features = rng.random((views.graph.views, config.channels, 7, 7)).astype(np.float16)
    appearance = rng.random((views.graph.views, len(TARGETS), config.channels)).astype(np.float16)
    return dataclasses.replace(views, digest="d1", features=features, appearance=appearance)


def make_collector(config: RunConfig = CONFIG, *rooms: RoomViews, max_actions: int = 10) -> Collector:
    """A collector in some rooms, by default a kitchen, with the graphs of their scenes."""
    rng = np.random.default_rng(5)
    env = BatchEnv(config.batch, rng, max_actions=max_actions)
    collector = Collector(config, env, rng)
    for views in rooms or (room_views(KITCHEN),):
        env.add_room(views)
        collector.use_graph(scene_graph(views.room.scene, 0))
    return collector
