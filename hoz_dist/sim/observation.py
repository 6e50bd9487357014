"""What an agent sees at a step, for B episodes at once."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Sight(NamedTuple):
    """What the camera and the encoder show of views, [...] standing for the shape of the view indices."""

    features: NDArray[np.float32]
    """Feature grids, [..., C, G, G]."""
    detections: NDArray[np.float32]
    """Box (x0, y0, x1, y1) over picture size and confidence of each category, [..., N, 5]."""
    appearance: NDArray[np.float32]
    """Average feature under each box, [..., N, C]."""


class Observation(NamedTuple):
    """The policy's input at a step of B episodes, or at T steps with [T, B] in place of [B]."""

    features: NDArray[np.float32]
    """Feature grids, [B, C, G, G]."""
    detections: NDArray[np.float32]
    """Box (x0, y0, x1, y1) over picture size and confidence of each category, [B, N, 5]."""
    appearance: NDArray[np.float32]
    """Average feature under each box, [B, N, C]."""
    target: NDArray[np.int64]
    """Index of the target category, [B]."""
    previous_action: NDArray[np.int64]
    """Action that led here, [B]; `NO_ACTION` at the first step of an episode."""
    scene: NDArray[np.int64]
    """Index of the room's true scene, [B]: the label of the scene layer, never an input."""
    first: NDArray[np.bool_]
    """Whether this is the first step of an episode, [B]."""
