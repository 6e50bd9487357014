"""Sampling of actions."""

import numpy as np
import torch
from torch import Tensor


def sample_actions(logits: Tensor, rng: np.random.Generator) -> Tensor:
    """Draw an action for each episode from the softmax of its logits.

    By the Gumbel-max trick with NumPy's generator, so that one seed gives the same actions whatever torch does
    elsewhere.

    Args:
        logits: [B, actions].
        rng: Source of randomness.

    Returns:
        Actions, int64 [B].
    """
    gumbel = rng.gumbel(size=tuple(logits.shape)).astype(np.float32)
    return (logits + torch.from_numpy(gumbel)).argmax(dim=-1)
