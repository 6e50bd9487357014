"""A tiny room is learnt within seconds, by every method, in one process."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from hoz_dist.config import RunConfig
from hoz_dist.graph.room_graph import explore_room
from hoz_dist.graph.scene_graph import merge_rooms
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.methods import METHODS
from hoz_dist.policy.methods.description import Method
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.pose_graph import PoseGraph
from hoz_dist.sim.room_views import RoomViews
from learner.optimizer import FlatAdam
from tests.unit.policy.steering import ImitatingSteering, steer_a3c
from tests.unit.sim.making import open_grid
from workers.collector import Collector

TARGET = TARGETS.index("Fridge")
UPDATES = 80


def looking_at_fridge(graph: PoseGraph) -> NDArray[np.bool_]:
    """Whether the fridge, which stands beyond the far wall, is in sight: at yaw 0."""
    return np.array([graph.pose(view).yaw == 0 for view in range(graph.views)])


def tiny_room() -> RoomViews:
    """A 3 x 3 room; the fridge is seen at yaw 0, and near enough in the last row."""
    graph = open_grid(3, 3)
    seen = looking_at_fridge(graph)
    near = np.repeat(graph.positions[:, 1] == 2, 16)
    success = np.zeros((graph.views, len(TARGETS)), dtype=np.bool_)
    success[:, TARGET] = seen & near
    detections = np.zeros((graph.views, len(TARGETS), 5), dtype=np.float32)
    size = np.where(near, 0.5, 0.2).astype(np.float32)
    detections[:, TARGET] = np.stack([0.5 - size / 2, 0.5 - size / 2, 0.5 + size / 2, 0.5 + size / 2, size > 0], 1)
    detections *= seen[:, None, None]
    features = np.zeros((graph.views, 6, 7, 7), dtype=np.float16)
    features[:, 2:] = 0.02 * np.random.default_rng(0).random((graph.views, 4, 7, 7))  # no two views are the same
    features[:, 0] = seen[:, None, None]
    features[:, 1] = (seen & near)[:, None, None]
    return RoomViews(
        room=RoomId("kitchen", 1),
        digest="tiny",
        graph=graph,
        features=features,
        detections=detections,
        appearance=detections[..., 4:].repeat(6, axis=-1).astype(np.float16),
        success=success,
        optimal=np.stack([graph.distances_to(goal) for goal in success.T], axis=1),
        targets=(TARGET,),
    )


def train(config: RunConfig, updates: int) -> tuple[float, NDArray[np.float32]]:
    """Train in one process; return the success rate of the last episodes and the parameters."""
    views = tiny_room()
    rng = np.random.default_rng(config.seed)
    env = BatchEnv(config.batch, rng, max_actions=30)
    env.add_room(views)
    collector = Collector(config, env, rng)
    graph = explore_room(
        str(views.room),
        views.digest,
        transitions=views.graph.transitions,
        positions=views.graph.positions,
        bags=views.bag,
        zones=config.zones,
    )
    collector.use_graph(merge_rooms("kitchen", [graph], version=1))
    optimizer = FlatAdam(initial_parameters(config.policy, config.seed), config.learning_rate)
    ended: list[bool] = []
    for _ in range(updates):
        collector.load(optimizer.parameters, optimizer.updates)
        update = collector.roll_out()
        optimizer.step(update.gradient)
        ended += [result.success for result in update.finished]
    return float(np.mean(ended[-200:])), optimizer.parameters.copy()


@pytest.mark.parametrize("method", METHODS)
def test_a_tiny_room_is_learnt(method: Method) -> None:
    success, _ = train(RunConfig(method=method, batch=16, learning_rate=3e-3), UPDATES)
    assert success > 0.9


def test_what_imitates_learns_the_experts_actions(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the labels alone: neither rewards nor entropy have a part in it."""
    steer_a3c(monkeypatch, ImitatingSteering)
    monkeypatch.setattr("hoz_dist.a3c.loss.ADVANTAGE_FLOOR", 1e9)
    config = RunConfig(method="a3c", batch=16, learning_rate=3e-3, entropy_weight=0.0, value_weight=0.0)
    assert train(replace(config, approach_weight=0.0), UPDATES)[0] > 0.8


def test_the_approach_is_learnt_from_its_labels_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a policy that neither rewards nor entropy teach, and whose search therefore stays what it was."""
    monkeypatch.setattr("hoz_dist.a3c.loss.ADVANTAGE_FLOOR", 1e9)
    config = RunConfig(method="a3c", batch=16, learning_rate=3e-3, entropy_weight=0.0, value_weight=0.0)
    taught, untaught = (train(replace(config, approach_weight=weight), 40)[0] for weight in (0.5, 0.0))
    assert taught > 0.4
    assert untaught < 0.2


def test_one_seed_gives_identical_parameters_twice() -> None:
    config = RunConfig(batch=8)
    assert np.array_equal(train(config, 5)[1], train(config, 5)[1])
    assert not np.array_equal(train(config, 5)[1], train(RunConfig(batch=8, seed=1), 5)[1])
    assert torch.get_num_threads() == 1
