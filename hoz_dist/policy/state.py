"""What the network remembers of episodes, and what it says of a step and of a rollout."""

from typing import NamedTuple

import torch
from torch import Tensor

from hoz_dist.policy.navigator import Guidance, ZoneState
from hoz_dist.policy.steering import Imitation, Memory


class State(NamedTuple):
    """Recurrent state of B episodes."""

    lstm: Tensor
    """[2, layers, B, cells]."""
    zone: ZoneState
    """Local copy of the scene graph; empty without the zone layer."""
    memory: Memory = ()
    """What the steering remembers of the episodes; empty without one."""
    target_seen: Tensor = torch.empty(0, dtype=torch.bool)
    """Whether the target has been seen in the episode, bool [B]; decides what is taught, and is no input."""

    def select(self, episodes: Tensor) -> "State":
        """Return the state of some of the episodes, by their indices."""
        return State(
            lstm=self.lstm[:, :, episodes],
            zone=ZoneState(*(part[episodes] for part in self.zone)),
            memory=tuple(part[episodes] for part in self.memory),
            target_seen=self.target_seen[episodes],
        )


class Decision(NamedTuple):
    """What the network says at one step."""

    logits: Tensor
    """[B, 6]."""
    value: Tensor
    """[B]."""
    state: State
    """State after the step."""
    guidance: Guidance
    """Scene, zone and sub-goal in use, to be recorded for `ActorCritic.unroll`."""


class Unrolled(NamedTuple):
    """What the network says over a rollout."""

    logits: Tensor
    """[T, B, 6]."""
    values: Tensor
    """[T, B]."""
    scene_logits: Tensor | None
    """[T, B, S], or None without the scene layer."""
    state: State
    """State after the rollout's last step, without gradient."""
    imitation: Imitation | None
    """What else is to be taught the expert's action, if anything is."""
    target_seen: Tensor
    """Whether the target has been seen in the episode, bool [T, B]."""
