"""Object branches: what a network makes of the detected objects before its inputs join.

A branch is a module that is called as ``branch(detections, appearance, target)`` with

- boxes and confidences per category, [B, N, 5],
- f^v, the average feature under each box, [B, N, C],
- the one-hot target indicator, [B, N],

where B may be all T * B steps of a rollout: a branch looks at one picture and remembers nothing. It returns either

- *maps* [B, M, W], which join as the picture does: flattened in the compact preset, and in the paper's as M = G * G
  cells of W channels; or
- a *vector* [B, X], which joins as the target indicator does.

The network has to know the shape before it makes the branch, so `BRANCHES` holds both by the layer's name.
"""

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from torch import nn

from hoz_dist.nav.categories import TARGETS
from hoz_dist.policy.layers import ObjectLayer
from hoz_dist.policy.layers_org import RelationLayer
from hoz_dist.policy.layers_sp import PriorLayer
from hoz_dist.policy.methods.description import Layer
from hoz_dist.policy.settings import PolicySettings

MAP_AXES: Final = 2
"""Axes of the maps of one picture; a vector has one."""


class Branch(NamedTuple):
    """How to make an object branch."""

    shape: Callable[[PolicySettings], tuple[int, ...]]
    """Returns the shape of its output for one picture: (M, W) of maps, (X,) of a vector."""
    make: Callable[[PolicySettings], nn.Module]


def _object_shape(settings: PolicySettings) -> tuple[int, ...]:
    return settings.sizes.objects, settings.channels + 1


def _object_layer(settings: PolicySettings) -> nn.Module:
    return ObjectLayer(len(TARGETS), settings.sizes.objects)


BRANCHES: Final[Mapping[Layer, Branch]] = {
    "object": Branch(_object_shape, _object_layer),
    "sp": Branch(PriorLayer.shape, PriorLayer),
    "org": Branch(RelationLayer.shape, RelationLayer),
}
"""The object branches, by layer."""
