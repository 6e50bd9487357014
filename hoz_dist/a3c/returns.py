"""Generalised advantage estimation; with lambda = 1 the n-step returns of A3C."""

import torch
from torch import Tensor

from hoz_dist.a3c.rollout import Rollout


def generalized_advantages(rollout: Rollout, discount: float, gae_lambda: float) -> tuple[Tensor, Tensor]:
    r"""Estimate advantages and returns (Schulman et al. 2016, Eq. 16).

    .. math::
        \delta_t = r_t + \gamma (1 - \text{terminated}_t) V_{t+1} - V_t, \quad
        A_t = \delta_t + \gamma \lambda (1 - \text{ended}_t) A_{t+1}

    A truncated episode's last value is bootstrapped: with NEXT_STEP autoreset, V_{t+1} is the value of its last
    observation.

    Args:
        rollout: T steps of B episodes.
        discount: gamma.
        gae_lambda: lambda; 1 gives n-step returns, 0 one-step ones.

    Returns:
        Advantages and returns (value targets), both float32 [T, B]; zero advantage where a step is not valid.
    """
    next_values = torch.cat([rollout.values[1:], rollout.bootstrap.unsqueeze(0)])
    continues = (~rollout.terminated).float()
    valid = rollout.valid.float()
    deltas = (rollout.rewards + discount * continues * next_values - rollout.values) * valid
    decay = discount * gae_lambda * (~(rollout.terminated | rollout.truncated)).float() * valid
    advantages = torch.empty_like(deltas)
    ahead = torch.zeros_like(rollout.bootstrap)
    for t in range(len(deltas) - 1, -1, -1):
        ahead = deltas[t] + decay[t] * ahead
        advantages[t] = ahead
    return advantages, advantages + rollout.values
