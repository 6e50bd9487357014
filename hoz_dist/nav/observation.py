"""What an agent perceives, for a batch of episodes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Observation(NamedTuple):
    """Observations of B episodes at one step, [B, ...], or of T steps, [T, B, ...]."""

    features: NDArray[np.float32]
    """Feature grid of the visual encoder, [B, C, G, G]."""
    detections: NDArray[np.float32]
    """Box (x0, y0, x1, y1) over picture size and confidence per category, [B, N, 5]; zeros when not seen."""
    appearance: NDArray[np.float32]
    """f^v: average of the feature grid under each category's box, [B, N, C]; zeros when not seen."""
    target: NDArray[np.int64]
    """Target category, [B]."""
    previous_action: NDArray[np.int64]
    """Action taken at the step before, as it was `hoz_dist.nav.feedback.felt`, [B]; ``NO_ACTION`` at the first step."""
    scene: NDArray[np.int64]
    """True scene, [B]: label of the scene layer, and chooses the graph where that is off (``--without scene``)."""
    first: NDArray[np.bool_]
    """Whether this is the first step of an episode, [B]."""
