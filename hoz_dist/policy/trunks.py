"""How the inputs join before the LSTM: as vectors (compact), or as maps of a 7 x 7 grid (the paper's)."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.policy.settings import PolicySettings


class VectorTrunk(nn.Module):
    """Every input is a vector; they are concatenated.

    Args:
        settings: What shapes the network.
        context: X, the sum of the sizes of all vector inputs.
        maps: Shape [M, W] of the object branch's maps; None without maps.

    Attributes:
        features: Size of the output.
        picture_features: F, size of what the scene layer sees of the picture.
    """

    def __init__(self, settings: PolicySettings, context: int, maps: tuple[int, int] | None) -> None:
        super().__init__()
        sizes = settings.sizes
        self.picture = nn.Linear(settings.channels * settings.grid**2, sizes.picture)
        self.picture_features = sizes.picture
        self.features = sizes.picture + context
        if maps is not None:
            self.features += maps[0] * maps[1]

    def see(self, features: Tensor) -> Tensor:
        """Map feature grids [B, C, G, G] to picture features [B, F]."""
        return functional.relu(self.picture(features.flatten(1)))

    def summary(self, picture: Tensor) -> Tensor:
        """Return what the scene layer sees of the picture, [B, F]."""
        return picture

    def forward(self, picture: Tensor, objects: Tensor | None, context: Tensor) -> Tensor:
        """Join the inputs.

        Args:
            picture: What `see` returned.
            objects: Maps of the object branch, [B, M, W], or None without maps.
            context: All vectors, [B, X].

        Returns:
            [B, `features`].
        """
        parts = [picture, context] if objects is None else [picture, context, objects.flatten(1)]
        return torch.cat(parts, dim=1)


class GridTrunk(nn.Module):
    """Every input is a map over the 7 x 7 grid; pointwise convolutions join them to 64 x 7 x 7 features.

    The object branch's maps have one row for each cell of the grid, M = G * G. Arguments and attributes are those of
    `VectorTrunk`.
    """

    def __init__(self, settings: PolicySettings, context: int, maps: tuple[int, int] | None) -> None:
        super().__init__()
        sizes = settings.sizes
        self.cells = settings.grid**2
        self.picture = nn.Linear(settings.channels, sizes.picture)
        self.picture_features = sizes.picture
        joined = sizes.picture + context
        if maps is not None:
            self.objects = nn.Linear(maps[1], sizes.picture)
            joined += sizes.picture
        self.join = nn.Linear(joined, sizes.picture)
        self.features = sizes.picture * self.cells

    def see(self, features: Tensor) -> Tensor:
        """Map feature grids [B, C, G, G] to picture features [B, G * G, F]; a pointwise convolution."""
        return functional.relu(self.picture(features.flatten(2).transpose(1, 2)))

    def summary(self, picture: Tensor) -> Tensor:
        """Return what the scene layer sees of the picture, [B, F]."""
        return picture.mean(dim=1)

    def forward(self, picture: Tensor, objects: Tensor | None, context: Tensor) -> Tensor:
        """Join the inputs; see `VectorTrunk.forward`."""
        # The pointwise convolution of all maps on top of each other, but part by part: the context is the same in
        # every cell, so its share is computed once, and nothing is copied together.
        widths = [picture.shape[2], context.shape[1]] + ([picture.shape[2]] if objects is not None else [])
        weights = torch.split(self.join.weight, widths, dim=1)
        joined = picture @ weights[0].t() + functional.linear(context, weights[1], self.join.bias).unsqueeze(1)
        if objects is not None:
            joined = joined + functional.relu(self.objects(objects)) @ weights[2].t()
        return functional.relu(joined).flatten(1)


def make_trunk(settings: PolicySettings, context: int, maps: tuple[int, int] | None = None) -> VectorTrunk | GridTrunk:
    """Make the trunk of a preset.

    Args:
        settings: The policy's settings.
        context: X, the sum of the sizes of all vector inputs.
        maps: Shape [M, W] of the object branch's maps; None without maps.
    """
    kind = VectorTrunk if settings.sizes.trunk == "vector" else GridTrunk
    return kind(settings, context, maps)
