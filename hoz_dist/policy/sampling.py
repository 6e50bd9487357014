"""Sampling of actions."""

import numpy as np
import torch
from torch import Tensor


def sample_actions(logits: Tensor, rng: np.random.Generator, temperature: float = 1.0) -> Tensor:
    """Draw an action for each episode from the softmax of its logits divided by a temperature.

    By the Gumbel-max trick with NumPy's generator, so that one seed gives the same actions whatever torch does
    elsewhere.

    Args:
        logits: [B, actions].
        rng: Source of randomness.
        temperature: 1 draws as the policy was trained to; towards 0 the likeliest action alone is drawn.

    Returns:
        Actions, int64 [B].
    """
    gumbel = rng.gumbel(size=tuple(logits.shape)).astype(np.float32)
    return (logits / temperature + torch.from_numpy(gumbel)).argmax(dim=-1)
