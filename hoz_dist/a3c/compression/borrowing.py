"""Tensors on the memory of arrays."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor


def borrowed(array: NDArray[Any]) -> Tensor:
    """Return a tensor on the memory of an array, which may be that of a message: nothing may write into the tensor."""
    return torch.from_numpy(array if array.flags.writeable else np.asarray(_Writable(array)))


class _Writable:
    """An array that says that it may be written into, and keeps its memory.

    Torch has no read-only tensors, and warns of an array that is. To keep it from that, filters of warnings would have
    to be changed, which are those of all threads.

    Args:
        array: Any array.
    """

    def __init__(self, array: NDArray[Any]) -> None:
        self._array = array
        interface = array.__array_interface__
        self.__array_interface__ = interface | {"data": (interface["data"][0], False)}
