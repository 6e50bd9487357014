"""Gradients of rollouts, on and off the policy that acted."""

import math
from dataclasses import replace
from typing import Any

import pytest
import torch

from hoz_dist.a3c import differentiation as module
from hoz_dist.a3c.differentiation import Behaviour, Differentiator
from hoz_dist.a3c.loss import Loss, a3c_loss
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.config import RunConfig
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.methods.description import Method
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.state import State
from tests.unit.a3c.making import make_rollout
from tests.unit.policy.making import make_observation, make_scene_graph, step_of

STEPS, BATCH = 6, 4


class Acted:
    """A rollout that a policy has really acted, as far as the network is concerned."""

    def __init__(self, config: RunConfig) -> None:
        self.policy = policy = make_policy(config.policy, seed=1)
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


def policy_alone(gae_lambda: float) -> Acted:
    """A rollout whose gradient is that of the policy's term."""
    config = RunConfig(batch=BATCH, rollout_steps=STEPS, gae_lambda=gae_lambda, gradient_norm=1e6)
    return Acted(replace(config, entropy_weight=0.0, scene_weight=0.0, value_weight=0.0))


@pytest.mark.parametrize("ratio", [0.5, 1e-3])
def test_what_another_policy_did_more_often_than_this_one_would_counts_less(ratio: float) -> None:
    """With lambda = 0 by just the ratio, whatever the advantages' size."""
    acted = policy_alone(gae_lambda=0.0)
    on_policy, _ = acted.off_policy(acted.behaviour)
    likelier = acted.behaviour.log_probabilities - math.log(ratio)
    found, _ = acted.off_policy(acted.behaviour._replace(log_probabilities=likelier))
    assert on_policy.norm() > 0.1
    torch.testing.assert_close(found / ratio, on_policy, rtol=1e-3, atol=1e-5)


def test_where_little_is_learnt_from_the_step_is_small() -> None:
    acted = policy_alone(gae_lambda=0.95)
    taken = int(acted.behaviour.valid.sum())
    some = acted.behaviour._replace(valid=acted.behaviour.valid & (torch.arange(BATCH) == 1))
    alone, _ = acted.off_policy(some)
    among, _ = acted.off_policy(some._replace(taken=taken))
    torch.testing.assert_close(among * taken, alone * int(some.valid.sum()), rtol=1e-3, atol=1e-5)


def test_the_value_after_the_last_step_is_of_full_precision_as_the_actors(monkeypatch: pytest.MonkeyPatch) -> None:
    acted = Acted(RunConfig(batch=BATCH, rollout_steps=STEPS, precision="bf16"))
    seen: list[Rollout] = []

    def noting(rollout: Rollout, *rest: Any) -> Loss:
        seen.append(rollout)
        return a3c_loss(rollout, *rest)

    monkeypatch.setattr(module, "a3c_loss", noting)
    _, state = acted.off_policy(acted.behaviour)
    decision = acted.policy.act(step_of(acted.observation, STEPS), state, acted.bank)
    torch.testing.assert_close(seen[0].bootstrap, decision.value, rtol=1e-5, atol=1e-6)


def test_a_rollout_of_which_nothing_is_learnt_still_has_a_gradient() -> None:
    acted = Acted(RunConfig(batch=BATCH, rollout_steps=STEPS, scene_weight=0.0))
    nothing = acted.behaviour._replace(valid=torch.zeros(STEPS, BATCH, dtype=torch.bool))
    found, _ = acted.off_policy(nothing)
    torch.testing.assert_close(found, torch.zeros_like(found))
