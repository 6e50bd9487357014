from itertools import combinations
from typing import get_args

import pytest
import torch

from hoz_dist.config import RunConfig
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.actor_critic import ActorCritic
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.methods import METHODS
from hoz_dist.policy.methods.description import Layer, Method
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, initial_parameters, make_policy
from hoz_dist.policy.settings import Precision, Preset
from hoz_dist.policy.state import Decision, State
from hoz_dist.policy.tape import dtype_of
from tests.unit.policy.making import make_observation, make_scene_graph, step_of

STEPS, BATCH = 9, 4
CONFIG = RunConfig()


@pytest.fixture
def bank() -> GraphBank:
    graphs = {scene: make_scene_graph(scene) for scene in ("kitchen", "bedroom")}
    return GraphBank.of(graphs, CONFIG.zones, CONFIG.edge_cost)


def act_over(policy: ActorCritic, observation: Observation, state: State, bank: GraphBank) -> list[Decision]:
    """Act step by step."""
    decisions = []
    for t in range(len(observation.target)):
        decisions.append(policy.act(step_of(observation, t), state, bank))
        state = decisions[-1].state
    return decisions


LAYERS = METHODS["hoz"].layers


@pytest.mark.parametrize("preset", ["compact", "paper"])
@pytest.mark.parametrize("without", [combination for n in range(5) for combination in combinations(LAYERS, n)])
def test_unrolling_says_what_acting_said(without: tuple[Layer, ...], preset: Preset, bank: GraphBank) -> None:
    """With every combination of the layers of `hoz`."""
    check_unrolling(RunConfig(without=without, preset=preset), bank)


@pytest.mark.parametrize("preset", ["compact", "paper"])
@pytest.mark.parametrize("method", [name for name in METHODS if name != "hoz"])
def test_unrolling_says_what_acting_said_with_every_method(method: Method, preset: Preset, bank: GraphBank) -> None:
    check_unrolling(RunConfig(method=method, preset=preset), bank)


def check_unrolling(config: RunConfig, bank: GraphBank) -> None:
    """Compare acting with unrolling, from a state in the middle of episodes, some of which come back to views."""
    policy = make_policy(config.policy, 0)
    before, observation = make_observation(3, BATCH, seed=1), make_observation(STEPS, BATCH)
    observation.first[0] = False
    observation.first[:, :2] = False
    observation.features[0], observation.features[4:7] = before.features[1], observation.features[1:4]
    start = act_over(policy, before, policy.initial_state(BATCH), bank)[-1].state
    decisions = act_over(policy, observation, start, bank)
    guidance = Guidance(*map(torch.stack, zip(*(decision.guidance for decision in decisions), strict=True)))
    with torch.no_grad():
        unrolled = policy.unroll(observation, start, guidance, bank)
    torch.testing.assert_close(unrolled.logits, torch.stack([d.logits for d in decisions]), atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(unrolled.values, torch.stack([d.value for d in decisions]), atol=1e-5, rtol=1e-4)
    assert (unrolled.scene_logits is not None) == config.policy.scene_layer
    after = decisions[-1].state
    torch.testing.assert_close(unrolled.state.lstm, after.lstm, atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(unrolled.state.zone.nodes, after.zone.nodes)
    assert torch.equal(unrolled.state.zone.scene, after.zone.scene)
    assert len(unrolled.state.memory) == len(after.memory)
    for mine, theirs in zip(unrolled.state.memory, after.memory, strict=True):
        torch.testing.assert_close(mine, theirs, atol=1e-5, rtol=1e-4)
    assert torch.equal(unrolled.target_seen, torch.stack([decision.state.target_seen for decision in decisions]))
    assert torch.equal(unrolled.state.target_seen, after.target_seen)


def test_that_the_target_was_seen_lasts_for_the_episode_over_rollouts(bank: GraphBank) -> None:
    """Acting and unrolling, over three rollouts, against a plain loop over episodes."""
    steps, batch = 3 * STEPS, 16
    observation = make_observation(steps, batch)
    policy = make_policy(CONFIG.policy, 0)
    decisions = act_over(policy, observation, policy.initial_state(batch), bank)
    target_seen = torch.stack([decision.state.target_seen for decision in decisions])
    for slot in range(batch):
        seen = False
        for t in range(steps):
            now = bool(observation.detections[t, slot, observation.target[t, slot], 4] > 0)
            seen = now or (seen and not observation.first[t, slot])
            assert bool(target_seen[t, slot]) == seen
    for t in (STEPS, 2 * STEPS):
        sees = torch.from_numpy(observation.detections[t, range(batch), observation.target[t], 4] > 0)
        assert (target_seen[t] & ~sees).any(), "sight lasts from one rollout to the next"
    assert (target_seen[:-1] & ~target_seen[1:]).any(), "and ends with the episode"
    state, found = policy.initial_state(batch), []
    for start in range(0, steps, STEPS):
        part = slice(start, start + STEPS)
        guidance = Guidance(*map(torch.stack, zip(*(one.guidance for one in decisions[part]), strict=True)))
        with torch.no_grad():
            unrolled = policy.unroll(Observation._make(values[part] for values in observation), state, guidance, bank)
        state = unrolled.state
        found.append(unrolled.target_seen)
    assert torch.equal(torch.cat(found), target_seen)


@pytest.mark.skipif(dtype_of("bf16") != torch.bfloat16, reason="the processor has no products of bf16")
@pytest.mark.parametrize("preset", ["compact", "paper"])
def test_products_in_bf16_change_outputs_and_gradient_little(preset: Preset, bank: GraphBank) -> None:
    observation = make_observation(STEPS, BATCH)
    outputs, gradients = [], []
    for precision in get_args(Precision):
        policy = make_policy(RunConfig(preset=preset, precision=precision).policy, 0)
        flat, tape, state = FlatParameters(policy), policy.tape(STEPS, BATCH), policy.initial_state(BATCH)
        decisions = []
        for t in range(STEPS):
            decisions.append(policy.act(step_of(observation, t), state, bank, tape))
            state = decisions[-1].state
        guidance = Guidance(*map(torch.stack, zip(*(decision.guidance for decision in decisions), strict=True)))
        unrolled = policy.unroll(observation, policy.initial_state(BATCH), guidance, bank, tape)
        (unrolled.logits.square().sum() + unrolled.values.sum()).backward()  # type: ignore[no-untyped-call]
        outputs.append(torch.cat([unrolled.logits.flatten(), unrolled.values.flatten()]).detach())
        gradients.append(flat.gradients.double())
    full, low = gradients
    assert not torch.equal(full, low)
    assert (full - low).norm() < 0.02 * full.norm()
    assert (outputs[0] - outputs[1]).norm() < 0.02 * outputs[0].norm()


def test_the_tape_of_acting_gives_the_same_gradient_as_computing_it_again(bank: GraphBank) -> None:
    policy = make_policy(CONFIG.policy, 0)
    flat = FlatParameters(policy)
    observation, start = make_observation(STEPS, BATCH), policy.initial_state(BATCH)
    tape, state, decisions = policy.tape(STEPS, BATCH), start, []
    for t in range(STEPS):
        decisions.append(policy.act(step_of(observation, t), state, bank, tape))
        state = decisions[-1].state
    guidance = Guidance(*map(torch.stack, zip(*(decision.guidance for decision in decisions), strict=True)))
    gradients = []
    for recorded in (tape, None):
        flat.gradients.zero_()
        unrolled = policy.unroll(observation, start, guidance, bank, recorded)
        (unrolled.logits.square().sum() + unrolled.values.sum()).backward()  # type: ignore[no-untyped-call]
        gradients.append(flat.gradients.clone())
    torch.testing.assert_close(gradients[0], gradients[1], atol=1e-5, rtol=1e-4)


def test_the_state_before_a_rollout_matters(bank: GraphBank) -> None:
    policy = make_policy(CONFIG.policy, 0)
    observation = make_observation(1, BATCH)
    observation.first[0] = False
    start = act_over(policy, make_observation(3, BATCH, seed=1), policy.initial_state(BATCH), bank)[-1].state
    fresh = policy.initial_state(BATCH)
    with_memory, without_lstm, without_graph = (
        policy.act(step_of(observation, 0), state, bank)
        for state in (start, start._replace(lstm=fresh.lstm), start._replace(zone=fresh.zone))
    )
    assert not torch.allclose(with_memory.logits, without_lstm.logits)
    assert not torch.allclose(with_memory.state.zone.nodes, without_graph.state.zone.nodes)


def unroll_once(policy: ActorCritic, bank: GraphBank) -> None:
    """Act and go back over it, so that every parameter has its gradient."""
    observation, start = make_observation(STEPS, BATCH), policy.initial_state(BATCH)
    observation.first[1:, :2] = False  # long enough to adapt
    observation.features[4:7] = observation.features[1:4]
    guidances = [decision.guidance for decision in act_over(policy, observation, start, bank)]
    guidance = Guidance(*map(torch.stack, zip(*guidances, strict=True)))
    unrolled = policy.unroll(observation, start, guidance, bank)
    loss = unrolled.logits.square().sum() + unrolled.values.sum()
    if unrolled.scene_logits is not None:
        loss = loss + unrolled.scene_logits.square().sum()
    if unrolled.imitation is not None:
        loss = loss + (unrolled.imitation.logits.square().sum(dim=(2, 3)) * unrolled.imitation.counts).sum()
    loss.backward()  # type: ignore[no-untyped-call]


@pytest.mark.parametrize("method", METHODS)
def test_the_gradient_reaches_every_parameter(method: Method, bank: GraphBank) -> None:
    """In the released code it does not reach lambda."""
    policy = make_policy(RunConfig(method=method).policy, 0)
    unroll_once(policy, bank)
    without = [name for name, p in policy.named_parameters() if p.grad is None or p.grad.abs().max() == 0.0]
    assert without == []


def test_only_known_scenes_are_used(bank: GraphBank) -> None:
    policy = make_policy(CONFIG.policy, CONFIG.seed)
    decision = policy.act(make_observation(64), policy.initial_state(64), bank)
    assert set(decision.guidance.scene.tolist()) <= {0, 2}  # kitchen and bedroom


def test_without_the_scene_layer_the_rooms_own_graph_is_used(bank: GraphBank) -> None:
    policy = make_policy(RunConfig(without=("scene",)).policy, 0)
    observation = make_observation(64)
    used = policy.act(observation, policy.initial_state(64), bank).guidance.scene.tolist()
    assert used == [scene if scene in {0, 2} else 0 for scene in observation.scene.tolist()]


def test_methods_differ_by_their_layers() -> None:
    sizes = [len(initial_parameters(RunConfig(method=method).policy, 0)) for method in ("a3c", "object", "hoz")]
    assert sizes == sorted(set(sizes))


def test_paper_preset_has_the_papers_size() -> None:
    assert 9.5e6 < len(initial_parameters(RunConfig(preset="paper").policy, 0)) < 9.9e6


def test_parameters_follow_from_the_seed_alone() -> None:
    first = initial_parameters(RunConfig(seed=3).policy, 3)
    torch.manual_seed(99)
    assert (initial_parameters(RunConfig(seed=3).policy, 3) == first).all()
    assert (initial_parameters(RunConfig(seed=4).policy, 4) != first).any()


def test_flat_parameters_are_the_networks_own(bank: GraphBank) -> None:
    policy = make_policy(CONFIG.policy, CONFIG.seed)
    flat = FlatParameters(policy)
    unroll_once(policy, bank)
    gathered = torch.cat([p.grad.flatten() for p in policy.parameters() if p.grad is not None])
    assert torch.equal(flat.gradients, gathered)
    other = initial_parameters(RunConfig(seed=5).policy, 5)
    flat.load(other)
    assert torch.equal(torch.cat([p.detach().flatten() for p in policy.parameters()]), torch.from_numpy(other))
    with pytest.raises(ValueError, match="expected"):
        flat.load(other[1:])
