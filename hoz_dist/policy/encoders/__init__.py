"""Visual encoders: fixed functions from pictures to grids of features."""

from pathlib import Path

from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.policy.encoders.pooled import PooledEncoder
from hoz_dist.policy.settings import EncoderName


def load_encoder(name: EncoderName, weights: Path | None = None) -> VisualEncoder:
    """Make a visual encoder.

    Args:
        name: ``pooled`` or ``resnet18``.
        weights: File with the weights of ``resnet18``.

    Raises:
        HozError: torchvision is not installed, or the weights cannot be read.
    """
    if name == "pooled":
        return PooledEncoder()
    # Imported here: torch and torchvision take seconds to import, and torchvision is an optional extra.
    from hoz_dist.policy.encoders.resnet18 import ResNet18Encoder  # noqa: PLC0415

    return ResNet18Encoder(weights)
