"""Rows of several arrays side by side, so that what a batch perceives is one look-up and one copy."""

import math

import numpy as np
from numpy.typing import NDArray

from hoz_dist.sim.row_table import LARGE_ROW_BYTES, RowTable

Array = NDArray[np.floating]


class JoinedTable:
    """A growing table of rows that are made of several arrays' rows, in float32.

    Conversion is done once, when rows are added; rows that are too large for that are kept as they are, and converted
    when they are taken.
    """

    def __init__(self) -> None:
        """Make an empty table."""
        self._width = 0
        self._parts: list[tuple[slice, tuple[int, ...]]] = []
        """Columns of each array's rows, and their shape."""
        self._joined: RowTable[np.float32] | None = None
        self._apart: list[RowTable[np.floating]] = []

    def append(self, *arrays: Array) -> None:
        """Add rows of each array, [rows, ...]; the arrays' shapes are those of the first call but for the rows."""
        if not self._parts:
            for array in arrays:
                start, self._width = self._width, self._width + math.prod(array.shape[1:])
                self._parts.append((slice(start, self._width), array.shape[1:]))
            if self._width * np.dtype(np.float32).itemsize < LARGE_ROW_BYTES:
                self._joined = RowTable()
            else:
                self._apart = [RowTable() for _ in arrays]
        if self._joined is None:
            for table, array in zip(self._apart, arrays, strict=True):
                table.append(array)
            return
        rows = np.empty((len(arrays[0]), self._width), np.float32)
        for part, array in zip(self._split(rows), arrays, strict=True):
            part[:] = array
        self._joined.append(rows)

    def take(self, indices: NDArray[np.int64]) -> list[NDArray[np.float32]]:
        """Return the rows at indices of any shape: of each array [*indices.shape, ...], in float32.

        They are copies, and may lie side by side in one array.
        """
        if self._joined is None:
            return [table.take(indices).astype(np.float32, copy=False) for table in self._apart]
        return self._split(self._joined.take(indices))

    def _split(self, rows: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Return the parts of joined rows, [..., width], as views of them."""
        return [rows[..., columns].reshape(*rows.shape[:-1], *shape) for columns, shape in self._parts]
