import dataclasses

import numpy as np
import torch

from hoz_dist.nav.episode import EpisodeResult
from tests.unit.workers.making import CONFIG, make_collector, scene_graph


def test_two_rollouts_act_as_one_that_is_twice_as_long() -> None:
    """The recurrent state and the episodes go on from one rollout to the next."""
    halves, whole = make_collector(), make_collector(dataclasses.replace(CONFIG, rollout_steps=48))
    finished: list[EpisodeResult] = []
    for _ in range(6):
        finished += halves.roll_out().finished
    assert finished == whole.roll_out().finished
    assert len(finished) > 10


def test_frames_are_the_actions_that_were_taken() -> None:
    collector = make_collector()
    updates = [collector.roll_out() for _ in range(10)]
    resets = sum(len(update.finished) for update in updates)
    total = len(updates) * CONFIG.rollout_steps * CONFIG.batch
    # Each end is followed by a step that only resets, the last ones perhaps in the next rollout.
    assert total - resets <= sum(update.frames for update in updates) <= total - resets + CONFIG.batch


def test_the_gradient_follows_from_parameters_and_seed() -> None:
    one, other = make_collector().roll_out(), make_collector().roll_out()
    assert np.array_equal(one.gradient, other.gradient)
    assert np.isfinite(one.gradient).all()
    assert 0.0 < np.linalg.norm(one.gradient) <= CONFIG.gradient_norm * 1.0001


def test_a_new_scene_graph_replaces_the_copies_of_running_episodes() -> None:
    """Merging another room may number the zones otherwise, so an old copy does not fit the new edges."""
    collector = make_collector()
    collector.roll_out()
    before = collector._state.zone
    collector.use_graph(scene_graph("bedroom", 1))
    assert torch.equal(collector._state.zone.scene, before.scene)
    collector.use_graph(scene_graph("kitchen", 2))
    assert (collector._state.zone.scene == -1).all()
    assert (before.scene == 0).all()
