"""What the learner makes of a gradient that it received."""

from typing import Final

import numpy as np
import torch

from hoz_dist.a3c.compression.borrowing import borrowed
from hoz_dist.gradient_forms import INT8_BLOCK, Bf16Gradient, Gradient, Int8Gradient, TopKGradient, Vector

_ROWS: Final = 512
"""Blocks of an `Int8Gradient` that are worked on at once: they stay in the cache."""


class Decompressor:
    """Turns gradients of any form into vectors.

    Args:
        size: P, number of entries.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._vector = np.empty(0, np.float32)

    def vector(self, gradient: Gradient) -> Vector:
        """Return the entries of a gradient, [P].

        Args:
            gradient: Of P entries, as checked when it was received.

        Returns:
            Valid until the next call; the gradient itself, read-only perhaps, if it is in full.
        """
        if isinstance(gradient, np.ndarray):
            return gradient
        if self._vector.size == 0:
            self._vector = np.zeros(self._size, np.float32)
        vector = torch.from_numpy(self._vector)
        match gradient:
            case Bf16Gradient(halves):
                vector.copy_(_numbers(halves))
            case Int8Gradient(levels, scales):
                _expand(borrowed(levels), borrowed(scales), vector)
            case TopKGradient(_, indices, halves):
                vector.zero_()
                self._vector[indices] = _numbers(halves).float().numpy()
        return self._vector


def _numbers(halves: np.ndarray[tuple[int, ...], np.dtype[np.uint16]]) -> torch.Tensor:
    """Return the bfloat16 of those bits."""
    return borrowed(halves.view(np.int16)).view(torch.bfloat16)


def _expand(levels: torch.Tensor, scales: torch.Tensor, vector: torch.Tensor) -> None:
    """Multiply the levels of each block by its scale; the last block may be a short one."""
    whole = levels.numel() // INT8_BLOCK
    end = whole * INT8_BLOCK
    rows = (levels[:end].view(whole, INT8_BLOCK), scales[:whole, None], vector[:end].view(whole, INT8_BLOCK))
    for some_levels, some_scales, values in zip(*(torch.split(row, _ROWS) for row in rows), strict=True):
        values.copy_(some_levels).mul_(some_scales)
    torch.mul(levels[end:], scales[whole:], out=vector[end:])
