"""What an actor records of T steps in B episodes, besides the observations."""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True, slots=True)
class Rollout:
    """T steps of B episodes under one behaviour policy.

    Episodes follow each other with NEXT_STEP autoreset: after the step that ends an episode comes one whose action is
    ignored (``valid`` is False), at which a truncated episode's last observation is seen.
    """

    actions: Tensor
    """int64 [T, B]."""
    rewards: Tensor
    """float32 [T, B]."""
    terminated: Tensor
    """Whether the episode ended by itself at the step, bool [T, B]."""
    truncated: Tensor
    """Whether the episode was cut off at the step, bool [T, B]."""
    valid: Tensor
    """Whether the action was taken, and is to be learnt from, bool [T, B]."""
    values: Tensor
    """V of the parameters that are differentiated at each step, float32 [T, B]."""
    bootstrap: Tensor
    """V of the observation after the last step, float32 [B]."""
    log_probabilities: Tensor | None = None
    """Log-probabilities of the actions under the behaviour policy, float32 [T, B]; None if it is the policy that is
    differentiated."""
    expert: Tensor | None = None
    """Which actions begin a shortest path at each step, bool [T, B, 6]: labels, never inputs. None if nothing is
    imitated."""
    taken: int | None = None
    """Number of actions taken, where not all of them are to be learnt from; None for those that are valid."""

    @property
    def frames(self) -> int:
        """Number of actions that are learnt from."""
        return int(self.valid.sum())

    def deltas(self, discount: float) -> Tensor:
        """Return the one-step errors of the values, ``r + discount * V' - V``, [T, B]; 0 where a step is not valid."""
        next_values = torch.cat([self.values[1:], self.bootstrap.unsqueeze(0)])
        continues = (~self.terminated).float()
        return (self.rewards + discount * continues * next_values - self.values) * self.valid.float()

    def decay(self, factor: float) -> Tensor:
        """Return ``factor`` where the episode goes on after the step, [T, B]; 0 where it ends or is not valid."""
        return factor * (~(self.terminated | self.truncated)).float() * self.valid.float()
