"""A network's parameters and gradients as one flat vector each.

The vector is what the optimiser steps, what is sent, and what a checkpoint holds, so nothing is gathered or copied
between those.
"""

from collections.abc import Iterator

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from hoz_dist.errors import InvalidValueError
from hoz_dist.policy.actor_critic import ActorCritic
from hoz_dist.policy.settings import PolicySettings


class FlatParameters:
    """Moves a module's parameters, and their gradients, into one contiguous float32 tensor each.

    Parameters keep the order of ``module.parameters()``. The module's tensors become views of `values` and
    `gradients`: changing one changes the other.

    Args:
        module: The network; it must not get other parameters later.

    Attributes:
        values: All parameters, float32 [P].
        gradients: Their gradients, float32 [P]; set them to zero in place before each backward pass.
    """

    def __init__(self, module: nn.Module) -> None:
        self._parameters = list(module.parameters())
        self.values = torch.cat([parameter.detach().flatten() for parameter in self._parameters])
        self.gradients = torch.zeros_like(self.values)
        for parameter, gradient in zip(self._parameters, self._views(self.gradients), strict=True):
            parameter.grad = gradient
        self.live_in(self.values)

    def live_in(self, values: Tensor) -> None:
        """Move the parameters into other memory and take on its numbers: who changes them there changes them here.

        Args:
            values: float32 [P], contiguous.
        """
        self.values = values
        for parameter, value in zip(self._parameters, self._views(values), strict=True):
            parameter.data = value

    def _views(self, flat: Tensor) -> Iterator[Tensor]:
        """Return the part of a flat vector [P] that belongs to each parameter, in its shape."""
        parts = torch.split(flat, [parameter.numel() for parameter in self._parameters])
        return (part.view_as(parameter) for part, parameter in zip(parts, self._parameters, strict=True))

    def load(self, vector: NDArray[np.float32]) -> None:
        """Replace the parameters.

        Args:
            vector: All parameters, [P].

        Raises:
            ValueError: The vector has another length.
        """
        if vector.shape != tuple(self.values.shape):
            message = f"expected {tuple(self.values.shape)} parameters, got {vector.shape}"
            raise ValueError(message)
        self.values.numpy()[:] = vector


def check_fit(checkpoint: int, network: int) -> None:
    """Look whether a checkpoint's parameters can be those of the network that this version makes of its configuration.

    Args:
        checkpoint: Number of parameters of the checkpoint.
        network: Number of parameters of the network.

    Raises:
        InvalidValueError: They cannot.
    """
    if checkpoint != network:
        message = (
            f"The checkpoint has {checkpoint} parameters, the network of its configuration {network}: it may be of an "
            "older version of hoz-dist; use the version that made it, or train anew."
        )
        raise InvalidValueError(message)


def make_policy(settings: PolicySettings, seed: int) -> ActorCritic:
    """Make a network whose initial parameters follow from a seed."""
    # A generator of its own would have to reach every layer's initialisation; forking keeps the caller's stream intact.
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return ActorCritic(settings)


def initial_parameters(settings: PolicySettings, seed: int) -> NDArray[np.float32]:
    """Return the initial parameters of a network, [P]; they follow from the arguments alone."""
    return FlatParameters(make_policy(settings, seed)).values.numpy()
