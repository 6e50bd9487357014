"""What any steering can rely on."""

import pytest
import torch

from hoz_dist.config import RunConfig
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.state import State
from tests.unit.policy.making import make_observation, step_of
from tests.unit.policy.steering import CountingSteering, steer_a3c

STEPS, BATCH = 9, 4
CONFIG = RunConfig(method="a3c")
BANK = GraphBank(CONFIG.zones, CONFIG.edge_cost)


def test_a_steerings_memory_lasts_an_episode_and_acting_and_unrolling_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    steer_a3c(monkeypatch, CountingSteering)
    policy = make_policy(CONFIG.policy, 0)
    observation, start = make_observation(STEPS, BATCH), policy.initial_state(BATCH)
    observation.first[0] = [True, True, False, False]
    start = start._replace(memory=(torch.tensor([5, 6, 7, 8]), torch.ones(BATCH, 1)))
    state, acted = start, []
    steps = start.memory[0].numpy().copy()
    for t in range(STEPS):
        decision = policy.act(step_of(observation, t), state, BANK)
        state = decision.state
        acted.append(decision)
        steps = (steps * ~observation.first[t]) + 1
        assert state.memory[0].tolist() == steps.tolist()
    guidance = Guidance(*map(torch.stack, zip(*(decision.guidance for decision in acted), strict=True)))
    unrolled = policy.unroll(observation, start, guidance, BANK)
    torch.testing.assert_close(unrolled.logits, torch.stack([d.logits for d in acted]), atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(unrolled.state.memory[1], state.memory[1], atol=1e-5, rtol=1e-4)
    assert unrolled.imitation is not None
    assert torch.equal(unrolled.imitation.counts[-1], state.memory[0] % 5 != 0)
    assert not any(part.requires_grad for part in unrolled.state.memory)


def test_gradients_go_through_the_memory_from_step_to_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last logits move with the weight by what all the outputs of the episode were, as a numerical check says."""
    steer_a3c(monkeypatch, CountingSteering)
    policy = make_policy(CONFIG.policy, 0)
    flat = FlatParameters(policy)
    observation = make_observation(STEPS, 1)
    observation.first[1:] = False
    start: State = policy.initial_state(1)
    guidance = Guidance(*(part.expand(STEPS, 1) for part in Guidance.nothing(1)))

    def last() -> torch.Tensor:
        return policy.unroll(observation, start, guidance, BANK).logits[-1].square().sum()

    last().backward()  # type: ignore[no-untyped-call]
    assert policy.steering is not None
    weight = policy.steering.get_parameter("weight")
    found, step = weight.grad, 1e-2
    assert found is not None
    assert flat.gradients.abs().max() > 0
    with torch.no_grad():
        before = weight.clone()
        weight.copy_(before + step * found)
        above = last()
        weight.copy_(before - step * found)
        below = last()
    torch.testing.assert_close((above - below) / (2 * step), found.square().sum(), rtol=2e-2, atol=1e-6)
