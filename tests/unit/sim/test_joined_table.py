import numpy as np
import pytest

from hoz_dist.sim.joined_table import JoinedTable
from hoz_dist.sim.row_table import LARGE_ROW_BYTES


@pytest.mark.parametrize("channels", [6, LARGE_ROW_BYTES])
def test_parts_of_joined_rows_are_what_was_added_in_float32(channels: int) -> None:
    """With many channels the rows are too large to be joined."""
    rng = np.random.default_rng(0)
    table = JoinedTable()
    halves = [rng.random((rows, channels, 2, 2)).astype(np.float16) for rows in (3, 5)]
    boxes = [rng.random((rows, 4), dtype=np.float32) for rows in (3, 5)]
    for block in zip(halves, boxes, strict=True):
        table.append(*block)
    indices = rng.integers(8, size=(3, 4))
    taken = table.take(indices)
    assert [part.dtype for part in taken] == [np.float32, np.float32]
    assert np.array_equal(taken[0], np.concatenate(halves)[indices])
    assert np.array_equal(taken[1], np.concatenate(boxes)[indices])
    taken[1][:] = 7.0
    assert not (table.take(indices)[1] == 7.0).any()  # what is taken is a copy
