"""Gradients of rollouts, on and off the policy that acted."""

from dataclasses import replace

import pytest
import torch

from hoz_dist.a3c.differentiation import Behaviour, Differentiator
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.config import RunConfig
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.actor_critic import State
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.settings import Method
from tests.unit.a3c.making import make_rollout
from tests.unit.policy.making import make_observation, make_scene_graph, step_of

STEPS, BATCH = 6, 4


class Acted:
    """A rollout that a policy has really acted, as far as the network is concerned."""

    def __init__(self, config: RunConfig) -> None:
        policy = make_policy(config.policy, seed=1)
        self.parameters = FlatParameters(policy)
        with torch.no_grad():
            # Far from uniform, so that probabilities differ.
            self.parameters.values.mul_(1.5)
        self.differentiator = Differentiator(config, policy, self.parameters)
        self.bank = GraphBank.of({"kitchen": make_scene_graph("kitchen")}, config.zones, config.edge_cost)
        self.start = policy.initial_state(BATCH)
        self.observation = make_observation(STEPS + 1, BATCH, seed=2)
        decisions, state = [], self.start
        for t in range(STEPS + 1):
            decisions.append(policy.act(step_of(self.observation, t), state, self.bank))
            state = decisions[-1].state
        self.after = decisions[-2].state
        self.guidance = Guidance(*map(torch.stack, zip(*(one.guidance for one in decisions), strict=True)))
        made = make_rollout(steps=STEPS, batch=BATCH, seed=3)
        logits = torch.stack([one.logits for one in decisions[:-1]])
        self.rollout = replace(
            made, values=torch.stack([one.value for one in decisions[:-1]]), bootstrap=decisions[-1].value
        )
        chosen = logits.log_softmax(-1).gather(-1, made.actions.unsqueeze(-1)).squeeze(-1)
        self.behaviour = Behaviour(
            made.actions, made.rewards, made.terminated, made.truncated, made.valid, log_probabilities=chosen
        )

    def on_policy(self, rollout: Rollout) -> torch.Tensor:
        observation = Observation._make(part[:STEPS] for part in self.observation)
        guidance = Guidance._make(part[:STEPS] for part in self.guidance)
        self.differentiator.on_policy(rollout, observation, guidance, self.start, self.bank)
        return self.parameters.gradients.clone()

    def off_policy(self, behaviour: Behaviour) -> tuple[torch.Tensor, State]:
        _, state = self.differentiator.off_policy(behaviour, self.observation, self.guidance, self.start, self.bank)
        return self.parameters.gradients.clone(), state


@pytest.mark.parametrize("method", ["a3c", "hoz"])
def test_on_the_same_parameters_both_ways_give_the_same_gradient(method: Method) -> None:
    acted = Acted(RunConfig(batch=BATCH, rollout_steps=STEPS, method=method, gradient_norm=1e6))
    expected = acted.on_policy(acted.rollout)
    found, state = acted.off_policy(acted.behaviour)
    assert expected.norm() > 0.1
    torch.testing.assert_close(found, expected, rtol=1e-4, atol=1e-5 * float(expected.abs().max()))
    torch.testing.assert_close(state.lstm, acted.after.lstm)
    torch.testing.assert_close(state.zone.nodes, acted.after.zone.nodes)


def test_what_another_policy_did_more_often_than_this_one_would_counts_less() -> None:
    acted = Acted(
        RunConfig(
            batch=BATCH, rollout_steps=STEPS, gradient_norm=1e6, entropy_weight=0.0, scene_weight=0.0, value_weight=0.0
        )
    )
    on_policy, _ = acted.off_policy(acted.behaviour)
    certain = acted.behaviour._replace(log_probabilities=torch.zeros(STEPS, BATCH))
    found, _ = acted.off_policy(certain)
    assert not torch.allclose(found, on_policy, rtol=0.1)


def test_a_rollout_of_which_nothing_is_learnt_still_has_a_gradient() -> None:
    acted = Acted(RunConfig(batch=BATCH, rollout_steps=STEPS, scene_weight=0.0))
    nothing = acted.behaviour._replace(valid=torch.zeros(STEPS, BATCH, dtype=torch.bool))
    found, _ = acted.off_policy(nothing)
    torch.testing.assert_close(found, torch.zeros_like(found))
