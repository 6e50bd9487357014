"""Tensors on what a message holds."""

import gc
import warnings
import weakref

import numpy as np
import pytest
import torch

from hoz_dist.a3c.compression.borrowing import borrowed


@pytest.mark.parametrize("dtype", [np.float32, np.int8, np.int16])
def test_a_tensor_is_on_the_memory_of_a_message_and_keeps_it(dtype: type[np.generic]) -> None:
    array = np.frombuffer(bytes(range(64)), dtype)[4:]
    expected, place, alive = array.copy(), array.ctypes.data, weakref.ref(array)
    tensor = borrowed(array)
    del array
    gc.collect()
    assert tensor.data_ptr() == place
    assert alive() is not None
    np.testing.assert_array_equal(tensor.numpy(), expected)
    del tensor
    gc.collect()
    assert alive() is None


def test_no_filter_of_warnings_is_touched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warnings, "catch_warnings", lambda: pytest.fail("other threads use the filters meanwhile"))
    read_only = np.ones(3, np.float32)
    read_only.flags.writeable = False
    torch.testing.assert_close(borrowed(read_only), torch.ones(3))
