"""Bounding the length of gradients."""

import torch
from torch import Tensor


def clip_norm(gradient: Tensor, largest: float) -> None:
    """Scale a gradient down in place if its Euclidean norm is above ``largest``."""
    norm = float(torch.linalg.vector_norm(gradient))
    if norm > largest:
        gradient.mul_(largest / norm)
