"""What each codec sends of a vector.

A codec takes out of a vector what travels, and leaves the rest, which `hoz_dist.a3c.compression.compressor` adds to the
next gradient. The learner refuses gradients whose norm is above the run's bound. So what a codec makes of a vector
never is: it is scaled down, and what that cuts off is lost, as it is without a codec.
"""

import math
from typing import Final, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hoz_dist.a3c.norm import clip_norm, gradient_norm
from hoz_dist.gradient_forms import INT8_BLOCK, Bf16Gradient, Gradient, Int8Gradient, TopKGradient, blocks_of

TOP_SHARE: Final = 0.01
"""Share of the entries that `TopK` sends."""
FIRST_SHARE: Final = 0.25
"""Share that it sends of the very first gradients."""
HALVED_EVERY: Final = 40
"""Versions after which that share is half of what it was, until it is `TOP_SHARE` at version 186."""
_BF16_ROUNDS_UP: Final = 1.0 + 2.0**-8
"""Rounding to 8 significant bits makes no number larger than by this factor."""
_LEVELS: Final = 127.0
"""Largest number of steps in an `Int8Gradient`."""
_SAMPLE: Final = 65_536
"""Entries that `TopK` looks at to guess where the largest ones begin."""
_PIECE: Final = 512 * INT8_BLOCK
"""Entries that are worked on at once where several passes are needed: they stay in the cache."""


class Codec(Protocol):
    """One way to send a vector."""

    def take(self, vector: Tensor, largest: float, version: int) -> Gradient:
        """Return what travels of a vector, and leave in the vector what does not.

        Args:
            vector: Float32 [P], finite; changed.
            largest: Largest Euclidean norm of what travels.
            version: Version of the parameters that the gradient was computed on.

        Returns:
            Arrays that are valid until the next call.
        """
        ...


class Bf16:
    """Sends every entry, rounded to the nearest bfloat16, to the even one of two.

    Args:
        size: P.
    """

    def __init__(self, size: int) -> None:
        self._halves = torch.empty(size, dtype=torch.bfloat16)

    def take(self, vector: Tensor, largest: float, version: int) -> Bf16Gradient:  # noqa: ARG002 - it sends as much early and late
        """See `Codec.take`."""
        clip_norm(vector, largest / _BF16_ROUNDS_UP)
        for values, halves in zip(torch.split(vector, _PIECE), torch.split(self._halves, _PIECE), strict=True):
            halves.copy_(values)
            values.sub_(halves.float())
        return Bf16Gradient(_bits(self._halves))


class Int8:
    """Sends every entry as the nearest of 255 steps from the largest one of its block to its negative.

    Args:
        size: P.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        # Whole blocks: the last one ends in zeros.
        self._padded = torch.zeros(blocks_of(size), INT8_BLOCK)
        self._levels = torch.empty(blocks_of(size), INT8_BLOCK, dtype=torch.int8)
        self._scales = torch.empty(blocks_of(size), 1)

    def take(self, vector: Tensor, largest: float, version: int) -> Int8Gradient:  # noqa: ARG002 - it sends as much early and late
        """See `Codec.take`."""
        clip_norm(vector, largest)
        sent = self._padded.view(-1)[: self._size]
        sent.copy_(vector)
        pieces = (torch.split(tensor, _PIECE // INT8_BLOCK) for tensor in (self._padded, self._levels, self._scales))
        for values, levels, scales in zip(*pieces, strict=True):
            highest, lowest = values.amax(dim=1, keepdim=True), values.amin(dim=1, keepdim=True)
            torch.div(torch.maximum(highest, -lowest), _LEVELS, out=scales)
            # A block of zeros, or of numbers so small that its scale is 0, has no steps at all.
            values.div_(scales.masked_fill(scales == 0.0, 1.0)).round_().clamp_(-_LEVELS, _LEVELS)
            levels.copy_(values)
            values.mul_(scales)
        # Rounding may have made it longer.
        norm = gradient_norm(sent.numpy())
        if norm > largest:
            self._scales.mul_(largest / norm)
            sent.mul_(largest / norm)
        vector.sub_(sent)
        return Int8Gradient(self._levels.view(-1)[: self._size].numpy(), self._scales.view(-1).numpy())


class TopK:
    """Sends the entries of the largest magnitude, `TOP_SHARE` of all, as bfloat16.

    In the first versions of the parameters it sends more, as Lin et al. [2018] do: then gradients agree with each other
    and every entry counts, since Adam moves all entries alike, however small their gradients are.

    The largest 1% hold at least 1% of the sum of squares, so what is left of gradients no longer than the bound of the
    norm never grows longer than some 200 times the bound. What is sent of an entry that is scaled down leaves the
    vector in full: else the same entries would be the largest again and again.

    Args:
        size: P.
    """

    def __init__(self, size: int) -> None:
        self._magnitudes = np.empty(size, np.float32)
        # Odd: rows of weight matrices have even lengths, and each entry of a row its own scale.
        self._stride = size // _SAMPLE | 1

    def take(self, vector: Tensor, largest: float, version: int) -> TopKGradient:
        """See `Codec.take`."""
        values = vector.numpy()
        indices = self._largest(values, max(round(share_at(version) * values.size), 1))
        chosen = torch.from_numpy(values[indices])
        clip_norm(chosen, largest / _BF16_ROUNDS_UP)
        halves = chosen.to(torch.bfloat16)
        values[indices] = (chosen - halves).numpy()
        return TopKGradient(values.size, indices.astype(np.uint32), _bits(halves))

    def _largest(self, values: NDArray[np.float32], count: int) -> NDArray[np.int64]:
        """Return where the largest entries are, [count], ascending; the same for the same values."""
        magnitudes = np.abs(values, out=self._magnitudes)
        sample = np.sort(magnitudes[:: self._stride])
        # As many candidates as are wanted, and some for the error of the guess. A guess that was too high is halved
        # in rank: sorting all would take a second.
        share = 1.25 * count / values.size
        while True:
            rank = sample.size - 1 - int(share * sample.size)
            least = sample[rank] if rank > 0 else np.float32(0.0)
            candidates = np.flatnonzero(magnitudes >= least)
            if candidates.size >= count:
                break
            share *= 2.0
        best = np.argpartition(magnitudes[candidates], -count)[-count:]
        return np.sort(candidates[best])


def share_at(version: int) -> float:
    """Return the share of the entries that `TopK` sends of a gradient that was computed on a version."""
    return max(TOP_SHARE, FIRST_SHARE * math.exp2(-version / HALVED_EVERY))


def _bits(halves: Tensor) -> NDArray[np.uint16]:
    return halves.view(torch.int16).numpy().view(np.uint16)
