import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from hoz_dist.a3c.returns import generalized_advantages
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.a3c.vtrace import vtrace
from tests.unit.a3c.making import make_rollout


def slow_vtrace(
    rollout: Rollout, learner: torch.Tensor, discount: float, gae_lambda: float
) -> tuple[np.ndarray, np.ndarray]:
    """Eq. 1 of Espeholt et al. as it stands, lambda in c [Remark 2]: the sum over all later steps of the episode."""
    steps, batch = rollout.rewards.shape
    values = torch.cat([rollout.values, rollout.bootstrap.unsqueeze(0)]).double().numpy()
    assert rollout.log_probabilities is not None
    advantages, corrections = np.zeros((steps, batch)), np.zeros((steps + 1, batch))

    def ratio(t: int, b: int) -> float:
        assert rollout.log_probabilities is not None
        return min(1.0, math.exp(float(learner[t, b]) - float(rollout.log_probabilities[t, b])))

    def delta(t: int, b: int) -> float:
        following = 0.0 if rollout.terminated[t, b] else discount * values[t + 1, b]
        return float(rollout.rewards[t, b] + following - values[t, b])

    for b in range(batch):
        for s in range(steps - 1, -1, -1):
            if not rollout.valid[s, b]:
                continue
            product = 1.0
            for t in range(s, steps):
                corrections[s, b] += product * ratio(t, b) * delta(t, b)
                product *= discount * gae_lambda * ratio(t, b)
                if rollout.terminated[t, b] or rollout.truncated[t, b]:
                    break
            ended = bool(rollout.terminated[s, b] or rollout.truncated[s, b])
            ahead = 0.0 if ended else discount * gae_lambda * corrections[s + 1, b]
            advantages[s, b] = ratio(s, b) * (delta(s, b) + ahead)
    return advantages, values[:-1] + corrections[:-1]


def off_policy(seed: int) -> tuple[Rollout, torch.Tensor]:
    """A rollout with ratios on both sides of the clip, and the log-probabilities of who learns from it."""
    rollout = make_rollout(steps=14, batch=9, seed=seed)
    generator = torch.Generator().manual_seed(seed)
    behaviour = -torch.rand(14, 9, generator=generator) * 3
    learner = -torch.rand(14, 9, generator=generator) * 3
    return replace(rollout, log_probabilities=behaviour), learner


@pytest.mark.parametrize(("discount", "gae_lambda"), [(0.99, 0.95), (0.9, 1.0), (0.99, 0.0)])
def test_advantages_and_targets_are_those_of_the_definition(discount: float, gae_lambda: float) -> None:
    rollout, learner = off_policy(3)
    for part in (rollout.terminated, rollout.truncated, ~rollout.valid):
        assert part.any()
    ratios, before, targets = vtrace(rollout, learner, discount, gae_lambda)
    advantages = ratios * before
    slow_advantages, slow_targets = slow_vtrace(rollout, learner, discount, gae_lambda)
    np.testing.assert_allclose(advantages.numpy(), slow_advantages, atol=1e-5)
    np.testing.assert_allclose(targets.numpy(), slow_targets, atol=1e-5)


@pytest.mark.parametrize("gae_lambda", [0.0, 0.95, 1.0])
def test_on_policy_it_is_generalised_advantage_estimation(gae_lambda: float) -> None:
    rollout, learner = off_policy(5)
    same = replace(rollout, log_probabilities=learner)
    ratios, *found = vtrace(same, learner, 0.99, gae_lambda)
    assert (ratios == 1.0).all()
    for mine, theirs in zip(found, generalized_advantages(same, 0.99, gae_lambda), strict=True):
        torch.testing.assert_close(mine, theirs, rtol=0.0, atol=0.0)


def test_what_the_learner_would_never_do_teaches_nothing() -> None:
    rollout, _ = off_policy(7)
    ratios, advantages, targets = vtrace(rollout, torch.full((14, 9), -60.0), 0.99, 0.95)
    assert (ratios * advantages).abs().max() < 1e-12
    torch.testing.assert_close(targets, rollout.values)


def test_what_the_learner_does_more_often_counts_no_more_than_once() -> None:
    rollout, _ = off_policy(8)
    assert rollout.log_probabilities is not None
    likelier = vtrace(rollout, rollout.log_probabilities + 50.0, 0.99, 0.95)
    on_policy = vtrace(rollout, rollout.log_probabilities, 0.99, 0.95)
    torch.testing.assert_close(likelier, on_policy)
