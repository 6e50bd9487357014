"""Which scenes a policy tells: runs in rooms know nothing of apartments, and are what they were without them."""

import dataclasses

import torch

from hoz_dist.config import RunConfig
from hoz_dist.nav.categories import ROOM_SCENES, SCENES, scene_index
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.parameters import FlatParameters, make_policy
from tests.unit.policy.making import make_observation, make_scene_graph

ROOMS, APARTMENTS = RunConfig(), RunConfig(scenes=len(SCENES))
BATCH = 32


def scenes_guessed(config: RunConfig) -> set[str]:
    """The scenes whose graphs a policy uses that knows the graphs of all scenes, by chance."""
    bank = GraphBank.of({scene: make_scene_graph(scene) for scene in SCENES}, config.zones, config.edge_cost)
    policy = make_policy(config.policy, 0)
    state, found = policy.initial_state(BATCH), set()
    for step in range(8):
        observation = make_observation(BATCH, seed=step)
        observation.first[:] = True
        decision = policy.act(observation, state, bank)
        state = decision.state
        assert not torch.isnan(decision.state.zone.evidence).any()
        found |= {SCENES[index] for index in decision.guidance.scene.tolist()}
    return found


def test_a_run_in_rooms_has_the_parameters_that_it_always_had() -> None:
    layer = make_policy(ROOMS.policy, 0).scene_layer
    assert layer is not None
    assert layer.linear.out_features == len(ROOM_SCENES) == 4
    more = FlatParameters(make_policy(APARTMENTS.policy, 0)).values.numel()
    assert more > FlatParameters(make_policy(ROOMS.policy, 0)).values.numel()


def test_a_run_in_rooms_never_takes_a_room_for_an_apartment() -> None:
    assert "apartment" not in scenes_guessed(ROOMS)
    assert "apartment" in scenes_guessed(APARTMENTS)


def test_without_the_scene_layer_the_graph_is_that_of_the_true_scene() -> None:
    config = dataclasses.replace(ROOMS, without=("scene",))
    bank = GraphBank.of({scene: make_scene_graph(scene) for scene in SCENES}, config.zones, config.edge_cost)
    policy, observation = make_policy(config.policy, 0), make_observation(BATCH)
    observation.scene[:] = scene_index("apartment")
    decision = policy.act(observation, policy.initial_state(BATCH), bank)
    assert set(decision.guidance.scene.tolist()) == {scene_index("apartment")}


def test_policies_whose_scene_layer_has_no_output_for_apartments_are_not_trained_there() -> None:
    assert all(ROOMS.tells(scene) for scene in ROOM_SCENES)
    assert not ROOMS.tells("apartment")
    assert APARTMENTS.tells("apartment")
    assert RunConfig(method="object").tells("apartment")
    assert RunConfig(without=("scene",)).tells("apartment")
