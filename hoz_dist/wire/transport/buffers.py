"""Large arrays whose memory is used again.

An array of tens of megabytes that comes fresh from the kernel costs more than what is written into it: 20 to 30 ms of
page faults for 40 MB, against 4 ms of copying.
"""

import weakref
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

_SPARE: Final = 2
"""Blocks that are kept for the next arrays; what is handed out besides is bounded by who keeps it."""


class Buffers:
    """Hands out float32 arrays; may be used from several threads.

    The memory of an array goes to the next one when nothing refers to it any more: neither the array, nor a part of it,
    nor a tensor on it.
    """

    def __init__(self) -> None:
        self._spare: deque[NDArray[np.float32]] = deque(maxlen=_SPARE)

    def empty(self, size: int) -> NDArray[np.float32]:
        """Return an array [size] with anything in it."""
        block = self._block(size)
        # On a memoryview: NumPy lets the parts of an array that lies on another array refer to that one alone.
        array = np.frombuffer(block.data, np.float32)
        weakref.finalize(array, self._spare.append, block).atexit = False
        return array

    def copy(self, vector: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a read-only copy of a vector [P]."""
        array = self.empty(vector.size)
        np.copyto(array, vector)
        array.flags.writeable = False
        return array

    def _block(self, size: int) -> NDArray[np.float32]:
        while self._spare:
            try:
                block = self._spare.pop()
            except IndexError:  # another thread took it
                break
            if block.size == size:
                return block
        return np.empty(size, np.float32)
