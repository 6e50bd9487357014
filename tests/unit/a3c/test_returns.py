import numpy as np
import pytest
import torch

from hoz_dist.a3c.returns import generalized_advantages
from hoz_dist.a3c.rollout import Rollout
from tests.unit.a3c.making import make_rollout


def slow_advantages(rollout: Rollout, discount: float, gae_lambda: float) -> np.ndarray:
    """Eq. 16 of Schulman et al. as it stands: the sum over all later steps of the same episode."""
    steps, batch = rollout.rewards.shape
    values = torch.cat([rollout.values, rollout.bootstrap.unsqueeze(0)]).numpy()
    result = np.zeros((steps, batch))
    for b in range(batch):
        for t in range(steps):
            if not rollout.valid[t, b]:
                continue
            for k in range(t, steps):
                ended = bool(rollout.terminated[k, b])
                delta = float(rollout.rewards[k, b]) - values[k, b] + (0.0 if ended else discount * values[k + 1, b])
                result[t, b] += (discount * gae_lambda) ** (k - t) * delta
                if ended or rollout.truncated[k, b]:
                    break
    return result


@pytest.mark.parametrize(("discount", "gae_lambda"), [(0.99, 0.95), (0.9, 1.0), (0.99, 0.0)])
def test_advantages_are_those_of_the_definition(discount: float, gae_lambda: float) -> None:
    rollout = make_rollout(steps=12, batch=7, seed=3)
    advantages, returns = generalized_advantages(rollout, discount, gae_lambda)
    np.testing.assert_allclose(advantages.numpy(), slow_advantages(rollout, discount, gae_lambda), atol=1e-5)
    torch.testing.assert_close(returns, advantages + rollout.values)


def test_with_lambda_one_returns_are_n_step_returns() -> None:
    rollout = make_rollout(steps=3, batch=1, seed=0, ends=False)
    _, returns = generalized_advantages(rollout, 0.5, 1.0)
    r, last = rollout.rewards[:, 0], rollout.bootstrap[0]
    assert float(returns[0, 0]) == pytest.approx(float(r[0] + 0.5 * r[1] + 0.25 * r[2] + 0.125 * last), abs=1e-5)


def test_a_truncated_episode_is_bootstrapped_and_a_terminated_one_is_not() -> None:
    base = make_rollout(steps=2, batch=2, seed=1, ends=False)
    rollout = Rollout(
        actions=base.actions,
        rewards=torch.zeros(2, 2),
        terminated=torch.tensor([[True, False], [False, False]]),
        truncated=torch.tensor([[False, True], [False, False]]),
        valid=torch.tensor([[True, True], [False, False]]),
        values=torch.tensor([[0.0, 0.0], [4.0, 4.0]]),
        bootstrap=torch.tensor([9.0, 9.0]),
    )
    advantages, _ = generalized_advantages(rollout, 0.5, 0.9)
    assert advantages.tolist() == [[0.0, 2.0], [0.0, 0.0]]
