"""What shapes a policy network: method, preset and layers."""

from dataclasses import dataclass, replace
from typing import Final, Literal

from hoz_dist.nav.categories import ROOM_SCENES
from hoz_dist.policy.methods import METHODS
from hoz_dist.policy.methods.description import Layer, Method

Preset = Literal["compact", "medium", "paper"]
EncoderName = Literal["pooled", "resnet18"]
Precision = Literal["fp32", "bf16"]
"""Of the products over rollouts, most of the arithmetic: their factors and results, and the maps of the trunk.
Parameters, cells, activations of the LSTM, heads and loss are always fp32; sums within a product are, too."""


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Layer sizes of a preset."""

    trunk: Literal["vector", "grid"]
    """How the inputs join: as vectors, or as maps of a 7 x 7 grid (the paper's)."""
    picture: int
    """Features of the picture (per grid cell in a grid trunk)."""
    target: int
    """Features of the target indicator."""
    action: int
    """Features of the previous action."""
    objects: int
    """D_o, columns of W_o in Eq. 6."""
    prior_nodes: int
    """Features of a node of the graph of `sp`."""
    prior: int
    """Output of the graph of `sp`."""
    relation_hidden: int
    """Hidden units for each category in `org`."""
    relation: int
    """Outputs for each category in `org`."""
    tentative: int
    """S, features of a state that TPN remembers."""
    zones: int
    """D_z, columns of W_z in Eq. 5."""
    lstm: int
    """Cells of an LSTM layer."""
    lstm_layers: int


_COMPACT: Final = Sizes(
    trunk="vector",
    picture=64,
    target=16,
    action=8,
    objects=16,
    prior_nodes=32,
    prior=32,
    relation_hidden=16,
    relation=4,
    tentative=32,
    zones=32,
    lstm=128,
    lstm_layers=1,
)
PRESETS: Final[dict[Preset, Sizes]] = {
    "compact": _COMPACT,
    "medium": replace(_COMPACT, lstm=256),
    "paper": Sizes(
        trunk="grid",
        picture=64,
        target=10,
        action=10,
        objects=49,  # H_o' f^v then has one row per cell of the 7 x 7 grid, as in the released code
        prior_nodes=256,  # SAVN's re-implementation has 1024, which would cost more than all the rest of the network
        prior=512,
        relation_hidden=128,
        relation=49,
        tentative=128,
        zones=10,
        lstm=512,
        lstm_layers=2,
    ),
}


@dataclass(frozen=True, kw_only=True)
class PolicySettings:
    """Everything that shapes the network; two networks of equal settings have equal parameter vectors."""

    sizes: Sizes
    channels: int
    """C of the visual encoder."""
    grid: int = 7
    """G of the visual encoder."""
    layers: tuple[Layer, ...] = METHODS["hoz"].layers
    """What is added to the network that all methods share."""
    relations: tuple[str, ...] = ()
    """Related categories, such as ``Bowl+Plate``: the graph of `sp`."""
    zones: int = 8
    """K of the scene graphs."""
    scenes: int = len(ROOM_SCENES)
    """S, outputs of the scene layer."""
    precision: Precision = "fp32"
    """Of the LSTM's products over rollouts; has no part in the parameters."""

    @classmethod
    def of(
        cls,
        method: Method,
        preset: Preset,
        *,
        channels: int,
        zones: int,
        scenes: int = len(ROOM_SCENES),
        without: tuple[Layer, ...] = (),
        relations: tuple[str, ...] = (),
        precision: Precision = "fp32",
    ) -> "PolicySettings":
        """Return the settings of a method, less some of its layers."""
        return cls(
            sizes=PRESETS[preset],
            channels=channels,
            zones=zones,
            scenes=scenes,
            layers=tuple(layer for layer in METHODS[method].layers if layer not in without),
            relations=relations,
            precision=precision,
        )

    @property
    def scene_layer(self) -> bool:
        """Whether the network guesses the scene."""
        return "scene" in self.layers

    @property
    def zone_layer(self) -> bool:
        """Whether scene graphs guide the agent."""
        return "zone" in self.layers

    @property
    def done_reminder(self) -> bool:
        """Whether the target's confidence scales Done's logit."""
        return "done" in self.layers
