"""ResNet-18 feature maps, 512 x 7 x 7, as in the paper.

Needs torchvision (`pip install hoz-dist[resnet]`) and a file with its weights.
"""

import hashlib
from pathlib import Path
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.torch import load_file
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.errors import DamagedFileError, HozError, InvalidValueError, NotFoundError

PICTURE_SIZE: Final = 224
"""Side to which pictures are scaled, pixels: five halvings give the 7 x 7 grid."""
CHUNK: Final = 32
"""Pictures that are encoded at once; more would only take memory."""
# Mean and standard deviation of ImageNet's colours, by which the published weights expect pictures to be normalised.
_MEAN: Final = (0.485, 0.456, 0.406)
_DEVIATION: Final = (0.229, 0.224, 0.225)


class ResNet18Encoder:
    """The convolutional part of torchvision's ResNet-18, with weights from a local file."""

    channels: Final = 512
    grid: Final = 7

    def __init__(self, weights: Path | None) -> None:
        """Load the network.

        Args:
            weights: State dict of torchvision's ``resnet18``, as ``.safetensors`` or ``.pth``.

        Raises:
            InvalidValueError: No weights are given.
            NotFoundError: There is no such file.
            DamagedFileError: The file does not hold the weights of a ResNet-18.
            HozError: torchvision is not installed.
        """
        if weights is None:
            message = "The resnet18 encoder needs --weights FILE, the state dict of torchvision's resnet18."
            raise InvalidValueError(message)
        try:
            from torchvision.models import resnet18  # noqa: PLC0415 # an optional extra
        except (ImportError, RuntimeError) as error:  # RuntimeError: torchvision built for another torch
            message = f"The resnet18 encoder needs torchvision: pip install 'hoz-dist[resnet]' ({error})."
            raise HozError(message) from error
        network = resnet18(weights=None)
        state = _read(weights)
        try:
            network.load_state_dict(state)
        except (RuntimeError, TypeError) as error:
            message = f"{weights} does not hold the weights of torchvision's resnet18."
            raise DamagedFileError(message) from error
        self.key: Final = f"resnet18-1-{hashlib.blake2b(weights.read_bytes(), digest_size=8).hexdigest()}"
        # Without the pooling and the classifier.
        self._network = nn.Sequential(*list(network.children())[:-2]).eval()

    @torch.inference_mode()
    def encode(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> NDArray[np.float16]:
        """Encode pictures; see `hoz_dist.nav.encoder.VisualEncoder.encode`. Depth is not used."""
        del depth
        mean, deviation = torch.tensor(_MEAN).view(1, 3, 1, 1), torch.tensor(_DEVIATION).view(1, 3, 1, 1)
        grids = []
        for chunk in torch.split(torch.from_numpy(np.ascontiguousarray(rgb)), CHUNK):
            pictures = chunk.permute(0, 3, 1, 2).float() / 255
            scaled = functional.interpolate(pictures, size=PICTURE_SIZE, mode="bilinear", align_corners=False)
            grids.append(self._network((scaled - mean) / deviation).half())
        return torch.cat(grids).numpy()


def _read(weights: Path) -> dict[str, Tensor]:
    if not weights.is_file():
        message = f"There is no weights file {weights}."
        raise NotFoundError(message)
    try:
        if weights.suffix == ".safetensors":
            return load_file(weights)
        # weights_only: nothing but tensors is ever unpickled, so a file cannot run code.
        state = torch.load(weights, map_location="cpu", weights_only=True)
    except Exception as error:  # safetensors and torch raise a dozen kinds for a file that is not theirs
        message = f"{weights} cannot be read as weights; give the .safetensors or .pth file that torchvision publishes."
        raise DamagedFileError(message) from error
    return dict(state)
