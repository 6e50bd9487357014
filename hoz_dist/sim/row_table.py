"""Rows of several rooms behind one index, so that a batch over many rooms is one look-up."""

import math
from itertools import pairwise
from typing import Final, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

LARGE_ROW_BYTES: Final = 4096
"""Rows from this size on stay where they are (memory-mapped) instead of being copied together.

A kitchen's 1600 views take 50 kB each with `resnet18` and 0.6 kB with `pooled`; the former would not fit into memory
for all rooms, and copying one row costs more than finding its room.
"""

Scalar = TypeVar("Scalar", bound=np.generic)


class RowTable(Generic[Scalar]):
    """A growing table of equally shaped rows; row i of the n-th block has index (rows of earlier blocks) + i."""

    def __init__(self) -> None:
        """Make an empty table."""
        self._starts = [0]
        self._blocks: list[NDArray[Scalar]] = []
        self._rows: NDArray[Scalar] | None = None

    def __len__(self) -> int:
        """Return the number of rows."""
        return self._starts[-1]

    def append(self, block: NDArray[Scalar]) -> None:
        """Add rows, [rows, ...]; small ones are copied, large ones are kept as they are."""
        start, stop = self._starts[-1], self._starts[-1] + len(block)
        self._starts.append(stop)
        if math.prod(block.shape[1:]) * block.itemsize >= LARGE_ROW_BYTES:
            self._blocks.append(block)
            return
        if self._rows is None or stop > len(self._rows):
            # Doubling keeps the cost of growth linear; untouched pages of an empty array take no memory.
            grown = np.empty((2 * stop, *block.shape[1:]), block.dtype)
            if self._rows is not None:
                grown[:start] = self._rows[:start]
            self._rows = grown
        self._rows[start:stop] = block

    def take(self, indices: NDArray[np.int64]) -> NDArray[Scalar]:
        """Return the rows at indices of any shape, [*indices.shape, ...]."""
        if self._rows is not None:
            return self._rows.take(indices, axis=0)
        flat = indices.ravel()
        taken = np.empty((len(flat), *self._blocks[0].shape[1:]), self._blocks[0].dtype)
        for block, (start, stop) in zip(self._blocks, pairwise(self._starts), strict=True):
            here = np.flatnonzero((flat >= start) & (flat < stop))
            if here.size:
                taken[here] = block[flat[here] - start]
        return taken.reshape(*indices.shape, *taken.shape[1:])

    def pick(self, indices: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[Scalar]:
        """Return one element of each of M small rows without further axes.

        Args:
            indices: The rows, [M].
            columns: Which element of each, [M].
        """
        assert self._rows is not None  # noqa: S101 - rows of success and transitions are small
        picked: NDArray[Scalar] = self._rows.ravel().take(indices * self._rows.shape[1] + columns)
        return picked
