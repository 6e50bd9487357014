"""The steerings that methods have; `hoz_dist.policy.steering` says what a steering is."""

from collections.abc import Callable, Mapping
from typing import Final

from hoz_dist.policy.methods.description import Layer
from hoz_dist.policy.settings import PolicySettings
from hoz_dist.policy.steering import Steering
from hoz_dist.policy.steering_savn import LearntAdaptation
from hoz_dist.policy.steering_tpn import TentativePolicy

STEERINGS: Final[Mapping[Layer, Callable[[PolicySettings], Steering]]] = {
    "savn": LearntAdaptation,
    "tpn": TentativePolicy,
}
"""What makes the steerings, by layer."""
