"""Vectors as gradients are: entries of many magnitudes, whole layers larger than others."""

import numpy as np
import torch

from hoz_dist.a3c.compression.decompressor import Decompressor
from hoz_dist.gradient_forms import Gradient, Vector

SIZES = (1, 2, 255, 256, 257, 1000, 20_011)
NO_BOUND = 1e30
LATE = 10**9
"""A version after all of the first ones."""


def vector(seed: int, size: int = 20_011, norm: float = 1.0) -> Vector:
    rng = np.random.default_rng(seed)
    layers = np.repeat(np.exp(2.0 * rng.normal(size=-(-size // 500))), 500)[:size]
    values = layers * rng.standard_t(3, size=size)
    return (values * (norm / np.linalg.norm(values))).astype(np.float32)


def received(gradient: Gradient) -> Vector:
    size = gradient.size
    return Decompressor(size).decompress(gradient).vector.copy()


def left(taken: torch.Tensor) -> Vector:
    found: Vector = taken.numpy()
    return found
