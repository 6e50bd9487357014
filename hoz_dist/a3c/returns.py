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
    advantages = backward_sum(rollout.deltas(discount), rollout.decay(discount * gae_lambda))
    return advantages, advantages + rollout.values


def backward_sum(terms: Tensor, decay: Tensor) -> Tensor:
    """Return S with ``S[t] = terms[t] + decay[t] * S[t + 1]``, and 0 after the last step.

    Args:
        terms: [T, B].
        decay: [T, B].
    """
    sums = torch.empty_like(terms)
    ahead = torch.zeros_like(terms[0])
    for t in range(len(terms) - 1, -1, -1):
        ahead = terms[t] + decay[t] * ahead
        sums[t] = ahead
    return sums
