import pytest
import torch

from hoz_dist.config import RunConfig
from hoz_dist.policy.actor_critic import ActorCritic
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, initial_parameters, make_policy
from hoz_dist.policy.settings import Method, Preset
from tests.unit.policy.making import make_observation, make_scene_graph, step_of

STEPS, BATCH = 9, 4
CONFIG = RunConfig()


@pytest.fixture
def bank() -> GraphBank:
    graphs = {scene: make_scene_graph(scene) for scene in ("kitchen", "bedroom")}
    return GraphBank.of(graphs, CONFIG.zones, CONFIG.edge_cost)


@pytest.mark.parametrize("preset", ["compact", "paper"])
@pytest.mark.parametrize("method", ["a3c", "object", "hoz"])
def test_unrolling_says_what_acting_said(method: Method, preset: Preset, bank: GraphBank) -> None:
    policy = make_policy(RunConfig(method=method, preset=preset).policy, 0)
    observation = make_observation(STEPS, BATCH)
    start = state = policy.initial_state(BATCH)
    decisions = []
    for t in range(STEPS):
        decision = policy.act(step_of(observation, t), state, bank)
        state = decision.state
        decisions.append(decision)
    guidance = Guidance(*map(torch.stack, zip(*(decision.guidance for decision in decisions), strict=True)))
    with torch.no_grad():
        unrolled = policy.unroll(observation, start, guidance, bank)
    torch.testing.assert_close(unrolled.logits, torch.stack([d.logits for d in decisions]), atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(unrolled.values, torch.stack([d.value for d in decisions]), atol=1e-5, rtol=1e-4)
    assert (unrolled.scene_logits is not None) == (method == "hoz")


def unroll_once(policy: ActorCritic, bank: GraphBank) -> None:
    """Act and go back over it, so that every parameter has its gradient."""
    observation = make_observation(STEPS, BATCH)
    start = state = policy.initial_state(BATCH)
    guidances = []
    for t in range(STEPS):
        decision = policy.act(step_of(observation, t), state, bank)
        state = decision.state
        guidances.append(decision.guidance)
    guidance = Guidance(*map(torch.stack, zip(*guidances, strict=True)))
    unrolled = policy.unroll(observation, start, guidance, bank)
    loss = unrolled.logits.square().sum() + unrolled.values.sum()
    if unrolled.scene_logits is not None:
        loss = loss + unrolled.scene_logits.square().sum()
    loss.backward()  # type: ignore[no-untyped-call]


@pytest.mark.parametrize("method", ["a3c", "object", "hoz"])
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
