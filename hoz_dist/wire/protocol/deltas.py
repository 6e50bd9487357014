"""Parameters as the difference to others that the reader has, in a quarter of the bytes.

The difference is cut into blocks. Each has a scale, the largest of its absolute values over 127, and every value is the
nearest whole multiple of the scale, -127 to 127: off by at most half of the scale. What a delta makes of its base is
the same to the bit wherever it is computed: ``base + float32(value) * scale``, each of the two operations rounded to
float32.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hoz_dist.wire.protocol.parameters import BLOCK

_STEPS: Final = np.float32(127.0)
_LEAST: Final = np.float32(1e-30)
"""A block whose values are all smaller counts as not changed: what 127 is over them must be finite."""
_AT_ONCE: Final = 256 * BLOCK
"""Values that are worked on in one go: they stay in the cache."""


class Quantised(NamedTuple):
    """A difference of two vectors [P]."""

    scales: NDArray[np.float32]
    """One for each block, [P / BLOCK, rounded up]."""
    values: NDArray[np.int8]
    """[P]."""


def quantise(vector: NDArray[np.float32], base: NDArray[np.float32]) -> Quantised:
    """Return the difference of two vectors [P]; of entries that are not finite a scale that is not."""
    size = vector.size
    result = Quantised(np.empty(-(-size // BLOCK), np.float32), np.empty(size, np.int8))
    scratch, magnitudes = np.empty(_AT_ONCE, np.float32), np.empty(_AT_ONCE, np.float32)
    starts = np.arange(0, _AT_ONCE, BLOCK)
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, size, _AT_ONCE):
            stop = min(start + _AT_ONCE, size)
            length, blocks = stop - start, -(-(stop - start) // BLOCK)
            difference = scratch[:length]
            np.subtract(vector[start:stop], base[start:stop], out=difference)
            np.abs(difference, out=magnitudes[:length])
            largest = np.maximum.reduceat(magnitudes[:length], starts[:blocks])
            scales = result.scales[start // BLOCK : start // BLOCK + blocks]
            _quantise_blocks(scratch[: blocks * BLOCK].reshape(blocks, BLOCK), largest, scales)
            result.values[start:stop] = difference
    return result


def add(base: NDArray[np.float32], delta: Quantised, out: NDArray[np.float32]) -> None:
    """Make vectors of vectors, or parts of parts.

    Args:
        base: [n], where ``n`` is a multiple of `BLOCK` unless it is the rest.
        delta: The difference; [n] values.
        out: [n], the sum.
    """
    for start in range(0, base.size, _AT_ONCE):
        stop = min(start + _AT_ONCE, base.size)
        part = out[start:stop]
        part[:] = delta.values[start:stop]
        whole = part.size // BLOCK * BLOCK
        first = start // BLOCK
        part[:whole].reshape(-1, BLOCK)[:] *= delta.scales[first : first + whole // BLOCK, None]
        if whole < part.size:
            part[whole:] *= delta.scales[-1]
        part += base[start:stop]


def _quantise_blocks(blocks: NDArray[np.float32], largest: NDArray[np.float32], scales: NDArray[np.float32]) -> None:
    """Turn differences [M, BLOCK] into whole multiples of scales [M], which are written too.

    Args:
        blocks: Differences; become multiples.
        largest: Largest absolute value of each block, [M].
        scales: Where the scales go.
    """
    changed = ~(largest < _LEAST)  # and what is no number
    np.divide(largest, _STEPS, out=scales)
    scales[~changed] = 0.0
    factors = np.divide(_STEPS, largest, out=np.zeros_like(largest), where=changed)
    blocks *= factors[:, None]
    np.rint(blocks, out=blocks)
