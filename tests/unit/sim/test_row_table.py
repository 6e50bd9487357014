import numpy as np
import pytest

from hoz_dist.sim.row_table import LARGE_ROW_BYTES, RowTable


@pytest.mark.parametrize("width", [3, LARGE_ROW_BYTES])
def test_rows_of_several_blocks_have_one_index(width: int) -> None:
    rng = np.random.default_rng(0)
    blocks = [rng.random((rows, width)).astype(np.float16) for rows in (4, 1, 30)]
    table: RowTable[np.float16] = RowTable()
    for block in blocks:
        table.append(block)
    whole = np.concatenate(blocks)
    indices = rng.integers(len(whole), size=(5, 7))
    assert len(table) == 35
    assert np.array_equal(table.take(indices), whole[indices])


def test_small_rows_are_copied_and_large_ones_are_not() -> None:
    for width, kept in ((3, False), (LARGE_ROW_BYTES, True)):
        block = np.zeros((2, width), dtype=np.uint8)
        table: RowTable[np.uint8] = RowTable()
        table.append(block)
        block[1] = 9
        assert bool(table.take(np.array([1]))[0, 0] == 9) is kept


def test_picked_elements_are_those_of_the_rows() -> None:
    rng = np.random.default_rng(0)
    blocks = [rng.integers(100, size=(rows, 6)) for rows in (4, 9)]
    table: RowTable[np.int64] = RowTable()
    for block in blocks:
        table.append(block)
    rows, columns = rng.integers(13, size=20), rng.integers(6, size=20)
    assert np.array_equal(table.pick(rows, columns), np.concatenate(blocks)[rows, columns])
