"""A network's parameters and gradients as one flat vector each.

The vector is what the optimiser steps, what is sent, and what a checkpoint holds, so nothing is gathered or copied
between those.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

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
        parameters = list(module.parameters())
        self.values = torch.empty(sum(p.numel() for p in parameters))
        self.gradients = torch.zeros_like(self.values)
        start = 0
        for parameter in parameters:
            end = start + parameter.numel()
            self.values[start:end] = parameter.detach().flatten()
            parameter.data = self.values[start:end].view_as(parameter)
            parameter.grad = self.gradients[start:end].view_as(parameter)
            start = end

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


def make_policy(settings: PolicySettings, seed: int) -> ActorCritic:
    """Make a network whose initial parameters follow from a seed."""
    # A generator of its own would have to reach every layer's initialisation; forking keeps the caller's stream intact.
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return ActorCritic(settings)


def initial_parameters(settings: PolicySettings, seed: int) -> NDArray[np.float32]:
    """Return the initial parameters of a network, [P]; they follow from the arguments alone."""
    return FlatParameters(make_policy(settings, seed)).values.numpy()
