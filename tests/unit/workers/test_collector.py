import dataclasses

import numpy as np
import torch

from hoz_dist.config import RunConfig
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph, merge_rooms
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.batch_env import BatchEnv
from tests.unit.sim.making import random_views
from workers.collector import Collector

CONFIG = RunConfig(batch=6, rollout_steps=8)


def scene_graph(scene: str, seed: int) -> SceneGraph:
    rng = np.random.default_rng(seed)
    edges = rng.random((CONFIG.zones, CONFIG.zones)) * 0.3
    edges = (edges + edges.T) / 2
    np.fill_diagonal(edges, 1.0)
    nodes = rng.random((CONFIG.zones, len(TARGETS)))
    return merge_rooms(scene, [RoomGraph(f"{scene}/1", "0" * 32, nodes, edges)], version=1)


def make(config: RunConfig = CONFIG) -> Collector:
    views = random_views(RoomId("kitchen", 1))
    rng = np.random.default_rng(5)
    features = rng.random((views.graph.views, config.channels, 7, 7)).astype(np.float16)
    appearance = rng.random((views.graph.views, len(TARGETS), config.channels)).astype(np.float16)
    env = BatchEnv(config.batch, rng, max_actions=10)
    env.add_room(dataclasses.replace(views, digest="d1", features=features, appearance=appearance))
    collector = Collector(config, env, rng)
    collector.use_graph(scene_graph("kitchen", 0))
    return collector


def test_two_rollouts_act_as_one_that_is_twice_as_long() -> None:
    """The recurrent state and the episodes go on from one rollout to the next."""
    halves, whole = make(), make(dataclasses.replace(CONFIG, rollout_steps=48))
    finished: list[EpisodeResult] = []
    for _ in range(6):
        finished += halves.roll_out().finished
    assert finished == whole.roll_out().finished
    assert len(finished) > 10


def test_frames_are_the_actions_that_were_taken() -> None:
    collector = make()
    updates = [collector.roll_out() for _ in range(10)]
    resets = sum(len(update.finished) for update in updates)
    total = len(updates) * CONFIG.rollout_steps * CONFIG.batch
    # Each end is followed by a step that only resets, the last ones perhaps in the next rollout.
    assert total - resets <= sum(update.frames for update in updates) <= total - resets + CONFIG.batch


def test_the_gradient_follows_from_parameters_and_seed() -> None:
    one, other = make().roll_out(), make().roll_out()
    assert np.array_equal(one.gradient, other.gradient)
    assert np.isfinite(one.gradient).all()
    assert 0.0 < np.linalg.norm(one.gradient) <= CONFIG.gradient_norm * 1.0001


def test_a_new_scene_graph_replaces_the_copies_of_running_episodes() -> None:
    """Merging another room may number the zones otherwise, so an old copy does not fit the new edges."""
    collector = make()
    collector.roll_out()
    before = collector._state.zone
    collector.use_graph(scene_graph("bedroom", 1))
    assert torch.equal(collector._state.zone.scene, before.scene)
    collector.use_graph(scene_graph("kitchen", 2))
    assert (collector._state.zone.scene == -1).all()
    assert (before.scene == 0).all()
