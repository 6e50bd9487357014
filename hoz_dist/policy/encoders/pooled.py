"""A coarse grid of the picture: needs no weights and no learning library."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

GRID: Final = 7
NEAREST_M: Final = 0.3
"""Depths below this, metres, count as this, so that inverse depth is bounded."""


class PooledEncoder:
    """Averages colour and inverse depth over the cells of a 7 x 7 grid.

    Channels: red, green, blue (mean, centred on 0), inverse depth (mean and largest: how near the nearest surface in
    the cell is), and the spread of brightness (texture: small objects change it when they hardly change the mean).
    """

    key: Final = "pooled-1-g7"
    channels: Final = 6
    grid: Final = GRID

    def encode(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> NDArray[np.float16]:
        """Encode pictures; see `hoz_dist.nav.encoder.VisualEncoder.encode`."""
        side = rgb.shape[1]
        # Cells as in adaptive average pooling, but without overlap; each has at least one pixel since side >= 16 > G.
        edges = np.arange(GRID) * side // GRID
        counts = np.diff(np.append(edges, side)).astype(np.float32)
        area = counts[:, None] * counts[None, :]

        def mean(values: NDArray[np.floating]) -> NDArray[np.float32]:  # [M, side, side, ...] -> [M, G, G, ...]
            sums = np.add.reduceat(np.add.reduceat(values, edges, axis=1), edges, axis=2)
            return np.asarray(sums / area.reshape(1, GRID, GRID, *([1] * (values.ndim - 3))), dtype=np.float32)

        colour = rgb.astype(np.float32) * np.float32(1 / 255)
        colour_mean = mean(colour)
        brightness = colour.mean(axis=3)
        spread = np.sqrt(np.maximum(mean(brightness**2) - mean(brightness) ** 2, 0.0))
        nearness = np.float32(NEAREST_M) / np.maximum(depth, np.float32(NEAREST_M))
        nearest = np.maximum.reduceat(np.maximum.reduceat(nearness, edges, axis=1), edges, axis=2)
        grid = np.concatenate(
            [colour_mean - 0.5, mean(nearness)[..., None], nearest[..., None], spread[..., None] * 2.0], axis=3
        )
        return np.ascontiguousarray(grid.transpose(0, 3, 1, 2)).astype(np.float16)
