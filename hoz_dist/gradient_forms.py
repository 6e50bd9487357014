"""The forms in which a gradient travels, one for each codec of `hoz_dist.config.Compression`: plain arrays.

What packs and judges them is `hoz_dist.wire.protocol.gradients`; what makes them and turns them back into a vector is
`hoz_dist.a3c.compression`. P is the number of parameters.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float32]
"""One number for each parameter, float32 [P]."""

INT8_BLOCK: Final = 256
"""Entries that share a scale in an `Int8Gradient`; the last block may have fewer."""


class Bf16Gradient(NamedTuple):
    """Every entry as a bfloat16."""

    halves: NDArray[np.uint16]
    """Their bits, [P]: the upper halves of those of float32."""

    @property
    def size(self) -> int:
        """P."""
        return self.halves.size


class Int8Gradient(NamedTuple):
    """Every entry as a whole number of steps, whose size is that of its block."""

    levels: NDArray[np.int8]
    """Number of steps, [P], -127 to 127."""
    scales: NDArray[np.float32]
    """Size of a step in each block of `INT8_BLOCK` entries, [P / INT8_BLOCK, rounded up], not negative."""

    @property
    def size(self) -> int:
        """P."""
        return self.levels.size


class TopKGradient(NamedTuple):
    """The largest entries; the others are 0."""

    size: int
    """P."""
    indices: NDArray[np.uint32]
    """Which entries, [k], ascending."""
    halves: NDArray[np.uint16]
    """Bits of their values, bfloat16, [k]."""


Gradient = Vector | Bf16Gradient | Int8Gradient | TopKGradient
"""A gradient in any form; one in full is the vector itself, float32 [P]."""


def blocks_of(size: int) -> int:
    """Return the number of blocks of an `Int8Gradient` of so many entries."""
    return -(-size // INT8_BLOCK)
