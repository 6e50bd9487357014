"""Tensors on the memory of arrays."""

import warnings
from typing import Any

import torch
from numpy.typing import NDArray
from torch import Tensor


def borrowed(array: NDArray[Any]) -> Tensor:
    """Return a tensor on the memory of an array, which may be that of a message: nothing may write into the tensor."""
    if array.flags.writeable:
        return torch.from_numpy(array)
    with warnings.catch_warnings():
        # Torch has no read-only tensors, and says so.
        warnings.filterwarnings("ignore", "The given NumPy array is not writable", UserWarning)
        return torch.from_numpy(array)
