"""What the network's layers read of an observation."""

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.observation import Observation


class Inputs(NamedTuple):
    """An observation as tensors; of T steps of B episodes, as of one step of T * B episodes."""

    features: Tensor
    """Feature grid of the visual encoder, [B, C, G, G]."""
    detections: Tensor
    """Boxes and confidences, [B, N, 5]."""
    appearance: Tensor
    """f^v, [B, N, C]."""
    target: Tensor
    """p, one-hot target indicator, [B, N]."""
    previous_action: Tensor
    """As it was `hoz_dist.nav.feedback.felt`, int64 [B]."""

    @classmethod
    def of(cls, observation: Observation) -> "Inputs":
        """Return what is read of an observation, [B, ...] or [T, B, ...]."""

        def flat(values: Tensor) -> Tensor:
            return values.reshape(-1, *values.shape[observation.target.ndim :])

        return cls(
            features=flat(torch.from_numpy(observation.features)),
            detections=flat(torch.from_numpy(observation.detections)),
            appearance=flat(torch.from_numpy(observation.appearance)),
            target=functional.one_hot(flat(torch.from_numpy(observation.target)), len(TARGETS)).float(),
            previous_action=flat(torch.from_numpy(observation.previous_action)),
        )

    @property
    def confidence(self) -> Tensor:
        """f^s, [B, N]."""
        return self.detections[..., 4]

    @property
    def bag(self) -> Tensor:
        """f, the bag of objects seen, [B, N]."""
        return (self.confidence > 0).float()

    @property
    def sees_target(self) -> Tensor:
        """Whether the target is seen, bool [B]."""
        return (self.confidence * self.target).sum(dim=-1) > 0
