"""What an actor records of T steps in B episodes, besides the observations."""

from dataclasses import dataclass

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
    """Whether the action was taken, bool [T, B]."""
    values: Tensor
    """V of the behaviour parameters at each step, float32 [T, B]."""
    bootstrap: Tensor
    """V of the observation after the last step, float32 [B]."""

    @property
    def frames(self) -> int:
        """Number of actions taken."""
        return int(self.valid.sum())
