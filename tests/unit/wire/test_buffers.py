from collections.abc import Callable

import numpy as np
import pytest
import torch

from hoz_dist.wire.transport.buffers import Buffers

SIZE = 1000


def place_of(array: np.ndarray) -> int:
    """Where its memory is."""
    return int(array.__array_interface__["data"][0])


def test_memory_is_used_again_when_nothing_refers_to_it() -> None:
    buffers = Buffers()
    array = buffers.empty(SIZE)
    place = place_of(array)
    del array
    again = buffers.empty(SIZE)
    assert place_of(again) == place
    assert place_of(buffers.empty(SIZE)) != place, "it is in use"


@pytest.mark.parametrize(
    "part_of",
    [lambda array: array[10:20].reshape(2, 5)[1], lambda array: torch.from_numpy(array)[3:]],
    ids=["part", "tensor"],
)
def test_a_part_or_a_tensor_keeps_the_memory(part_of: Callable[[np.ndarray], object]) -> None:
    buffers = Buffers()
    array = buffers.empty(SIZE)
    place = place_of(array)
    part = part_of(array)
    del array
    assert place_of(buffers.empty(SIZE)) != place
    del part
    assert place in {place_of(one) for one in [buffers.empty(SIZE), buffers.empty(SIZE)]}


def test_memory_of_another_size_is_not_used() -> None:
    buffers = Buffers()
    del_me = buffers.empty(SIZE)
    del del_me
    assert buffers.empty(SIZE + 1).size == SIZE + 1


def test_a_copy_is_one_and_cannot_be_written() -> None:
    vector = np.arange(SIZE, dtype=np.float32)
    copy = Buffers().copy(vector)
    vector += 1
    assert not copy.flags.writeable
    np.testing.assert_array_equal(copy, np.arange(SIZE))
