"""What detected objects look like: the encoder's features under their boxes."""

import numpy as np
from numpy.typing import NDArray


def appearance(features: NDArray[np.float16], detections: NDArray[np.float32]) -> NDArray[np.float16]:
    """Average the feature grid under each box, every cell weighed by the area that the box covers of it.

    Args:
        features: Feature grids, [M, C, G, G].
        detections: Box (x0, y0, x1, y1) over picture size and confidence, [M, N, 5].

    Returns:
        f^v, [M, N, C]; zeros where the confidence is 0.
    """
    pictures, channels, grid, _ = features.shape
    across = _overlap(detections[..., 0], detections[..., 2], grid)
    down = _overlap(detections[..., 1], detections[..., 3], grid)
    weights = (down[..., :, None] * across[..., None, :]).reshape(pictures, -1, grid * grid)  # [M, N, G * G]
    total = weights.sum(axis=2, keepdims=True)
    weights = np.divide(weights, total, out=np.zeros_like(weights), where=(total > 0) & (detections[..., 4:] > 0))
    cells = features.reshape(pictures, channels, grid * grid).astype(np.float32)
    average: NDArray[np.float32] = cells @ weights.transpose(0, 2, 1)  # [M, C, N]
    return average.transpose(0, 2, 1).astype(np.float16)


def _overlap(low: NDArray[np.float32], high: NDArray[np.float32], grid: int) -> NDArray[np.float32]:
    """Return the length of [low, high] within each of the G cells of [0, 1], [..., G]."""
    edges = np.arange(grid + 1, dtype=np.float32) / np.float32(grid)
    overlap: NDArray[np.float32] = np.minimum(high[..., None], edges[1:]) - np.maximum(low[..., None], edges[:-1])
    return overlap.clip(min=0.0)
