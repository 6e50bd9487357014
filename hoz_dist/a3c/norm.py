"""The length of gradients: actors bound it, and the learner checks that they did, with the same function."""

import math
from typing import Final

import numpy as np
from torch import Tensor

from hoz_dist.gradient_forms import Vector

PIECE: Final = 64 * 1024
"""Entries whose squares are summed in float32; the sums of pieces are added in float64. A piece fits a core's cache."""


def gradient_norm(gradient: Vector) -> float:
    """Return the Euclidean norm of a gradient [P], off by less than a millionth of itself.

    One pass in float32, about a tenth of the cost of an Adam step. It goes piece by piece: one sum over ten million
    entries loses the small ones behind the large ones, up to 0.3% when those come first. A piece with entries beyond
    1e19, whose squares overflow, takes a second pass in float64. NaN or infinite when an entry is.
    """
    pieces = (gradient[start : start + PIECE] for start in range(0, gradient.size, PIECE))
    return math.sqrt(sum(map(squares_of, pieces)))


def squares_of(piece: Vector) -> float:
    """Return the sum of the squares of at most `PIECE` entries; not finite when one of them is not."""
    with np.errstate(over="ignore", invalid="ignore"):
        squares = float(np.dot(piece, piece))
    if not math.isfinite(squares):
        exact = piece.astype(np.float64)
        squares = float(np.dot(exact, exact))
    return squares


def clip_norm(gradient: Tensor, largest: float) -> None:
    """Scale a gradient [P], in main memory, down in place if its Euclidean norm is above ``largest``."""
    norm = gradient_norm(gradient.numpy())
    if norm > largest:
        gradient.mul_(largest / norm)
