"""What the simulator needs to know of a visual encoder."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class VisualEncoder(Protocol):
    """Turns pictures into grids of features; fixed, so that its outputs can be cached with the pictures."""

    @property
    def key(self) -> str:
        """Names everything that shapes the features (kind, version, digest of the weights); part of the cache key."""
        ...

    @property
    def channels(self) -> int:
        """C, the number of features of a grid cell."""
        ...

    @property
    def grid(self) -> int:
        """G, the number of grid cells along a side."""
        ...

    def encode(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> NDArray[np.float16]:
        """Encode M square pictures.

        Args:
            rgb: Colours, [M, side, side, 3].
            depth: Distance along the viewing axis in metres, [M, side, side].

        Returns:
            Feature grids, [M, C, G, G].
        """
        ...
