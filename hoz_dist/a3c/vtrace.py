"""V-trace: advantages and value targets of a rollout that another policy acted (Espeholt et al. 2018)."""

import math
from typing import Final, NamedTuple

import torch
from torch import Tensor

from hoz_dist.a3c.returns import backward_sum
from hoz_dist.a3c.rollout import Rollout

LARGEST_RATIO: Final = 1.0
"""Both of the paper's clips, of rho and of c: the paper's own choice."""


class VTrace(NamedTuple):
    """What V-trace makes of a rollout, float32 [T, B] each."""

    ratios: Tensor
    """rho: how much each step counts, in [0, 1]."""
    advantages: Tensor
    """Of the actions, before they are multiplied by rho; zero where a step is not valid."""
    targets: Tensor
    """Value targets."""


def vtrace(rollout: Rollout, log_probabilities: Tensor, discount: float, gae_lambda: float) -> VTrace:
    r"""Estimate advantages and value targets off-policy, with lambda as in GAE.

    With importance ratios clipped at 1, :math:`\rho_t = c_t = \min(1, \pi(a_t) / \mu(a_t))`, Eq. 1 and Remark 2 of the
    paper:

    .. math::
        v_t - V_t = \rho_t \delta_t + \gamma \lambda c_t (1 - \text{ended}_t) (v_{t+1} - V_{t+1}), \quad
        \delta_t = r_t + \gamma (1 - \text{terminated}_t) V_{t+1} - V_t

    and the advantage, which with :math:`\rho_t` multiplies the policy's gradient, Section 4.2 with lambda,

    .. math::
        A_t = \delta_t + \gamma \lambda (1 - \text{ended}_t) (v_{t+1} - V_{t+1}).

    Deviation from the paper: it has no lambda in A. With it, both are those of `generalized_advantages` when the
    policies are the same, whatever lambda is; with lambda = 1 both are the paper's. A and rho stay apart, so that who
    scales advantages to a size of his own does not undo rho.

    Args:
        rollout: T steps of B episodes, with the log-probabilities of the policy that acted and the values of the one
            that learns.
        log_probabilities: Of the actions under the policy that learns, [T, B].
        discount: gamma.
        gae_lambda: lambda.
    """
    behaviour = rollout.log_probabilities
    assert behaviour is not None  # noqa: S101 - only what another policy acted comes here
    ratios = (log_probabilities - behaviour).clamp(max=math.log(LARGEST_RATIO)).exp()
    deltas = rollout.deltas(discount)
    decay = rollout.decay(discount * gae_lambda)
    corrections = backward_sum(ratios * deltas, ratios * decay)
    ahead = torch.cat([corrections[1:], torch.zeros_like(corrections[:1])])
    return VTrace(ratios, deltas + decay * ahead, rollout.values + corrections)
