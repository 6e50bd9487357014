"""What the learner makes of a gradient that it received."""

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
import torch

from hoz_dist.a3c.compression.borrowing import borrowed
from hoz_dist.a3c.norm import PIECE, gradient_norm, squares_of
from hoz_dist.gradient_forms import INT8_BLOCK, Bf16Gradient, Gradient, Int8Gradient, TopKGradient, Vector

_BLOCKS: Final = PIECE // INT8_BLOCK


class Decompressed(NamedTuple):
    """A gradient as the optimiser takes it."""

    vector: Vector
    """Its entries times the weight, [P]; valid until the next gradient, read-only perhaps."""
    norm: float
    """Euclidean norm of the gradient itself, without the weight."""


class Decompressor:
    """Turns gradients of any form into vectors, and takes their norm while they are in the cache.

    Args:
        size: P, number of entries.
    """

    def __init__(self, size: int) -> None:
        self._vector = np.zeros(size, np.float32)

    def decompress(self, gradient: Gradient, weight: float = 1.0) -> Decompressed:
        """Return the entries of a gradient and its norm.

        Args:
            gradient: Of P entries; left as it is. If one is not finite, neither is the norm.
            weight: Factor of the entries, from 0 (excluded) to 1.
        """
        match gradient:
            case TopKGradient(_, indices, halves):
                values = _numbers(halves).float().numpy()
                self._vector.fill(0.0)
                self._vector[indices] = values * np.float32(weight)
                return Decompressed(self._vector, gradient_norm(values))
            case np.ndarray() if weight == 1.0:
                return Decompressed(gradient, gradient_norm(gradient))
        squares = sum(map(squares_of, self._expand(gradient, weight)))
        return Decompressed(self._vector, math.sqrt(squares) / weight)

    def _expand(self, gradient: Vector | Bf16Gradient | Int8Gradient, weight: float) -> Iterator[Vector]:
        """Write the entries times the weight, piece by piece; yield each piece."""
        pieces = [self._vector[start : start + PIECE] for start in range(0, self._vector.size, PIECE)]
        match gradient:
            case Bf16Gradient(halves):
                for piece, numbers in zip(pieces, torch.split(_numbers(halves), PIECE), strict=True):
                    entries = torch.from_numpy(piece).copy_(numbers)
                    if weight != 1.0:
                        entries.mul_(weight)
                    yield piece
            case Int8Gradient(levels, scales):
                steps = torch.split(borrowed(scales) * weight, _BLOCKS)
                for piece, some, size in zip(pieces, torch.split(borrowed(levels), PIECE), steps, strict=True):
                    _scale(some, size, torch.from_numpy(piece))
                    yield piece
            case _:
                for start, piece in zip(range(0, gradient.size, PIECE), pieces, strict=True):
                    yield np.multiply(gradient[start : start + PIECE], np.float32(weight), out=piece)


def _numbers(halves: np.ndarray[tuple[int, ...], np.dtype[np.uint16]]) -> torch.Tensor:
    """Return the bfloat16 of those bits."""
    return borrowed(halves.view(np.int16)).view(torch.bfloat16)


def _scale(levels: torch.Tensor, scales: torch.Tensor, out: torch.Tensor) -> None:
    """Multiply the levels of each block by its scale; the last block may be a short one."""
    whole = levels.numel() // INT8_BLOCK
    end = whole * INT8_BLOCK
    out[:end].view(whole, INT8_BLOCK).copy_(levels[:end].view(whole, INT8_BLOCK)).mul_(scales[:whole, None])
    torch.mul(levels[end:], scales[whole:], out=out[end:])
