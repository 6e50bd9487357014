"""The configuration of a run: all that the learner, its actors and an evaluation must agree on."""

from dataclasses import asdict, dataclass, fields
from typing import Any, Final, Literal, get_args

from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.graph.checks import MAX_ZONES
from hoz_dist.graph.merging import GraphSource, Merging
from hoz_dist.graph.planner import DEFAULT_EDGE_COST, EdgeCost, Subgoal
from hoz_dist.graph.zones import Clustering
from hoz_dist.nav.categories import ROOM_SCENES, SCENES
from hoz_dist.nav.pose import PICTURE_SIZE
from hoz_dist.policy.methods import METHODS
from hoz_dist.policy.methods.description import Layer, Method
from hoz_dist.policy.relations import check_relations, shipped_relations
from hoz_dist.policy.settings import EncoderName, PolicySettings, Precision, Preset

Compression = Literal["fp32", "bf16", "int8", "topk"]
"""How gradients travel: in full, as halves, as bytes, or their largest entries alone."""
ParametersForm = Literal["full", "delta"]
"""How parameters travel: in full, or as the difference to a version that their reader has."""
Source = Literal["gradients", "rollouts"]
"""What actors push, and the learner learns from."""

PRESET_LEARNING_RATES: Final[dict[Preset, float]] = {"compact": 1e-3, "medium": 1e-3, "paper": 1e-4}
"""Adam's learning rate at the start; the paper's is 1e-4."""
PRESET_PRECISIONS: Final[dict[Preset, Precision]] = {"compact": "fp32", "medium": "fp32", "paper": "bf16"}
"""Precision of the LSTM's products: small ones gain nothing from the lower one."""


@dataclass(frozen=True, kw_only=True)
class RunConfig:
    """One run's configuration; validated at construction.

    Raises:
        InvalidValueError: A value is out of its range.
        UnknownNameError: A value of a field with named values does not exist.
    """

    method: Method = "hoz"
    without: tuple[Layer, ...] = ()
    """Layers of the method that are switched off."""
    relations: tuple[str, ...] = ()
    """Related categories, such as ``Bowl+Plate``: the graph of method `sp`, whose default are those of the training
    rooms; no other method has any, so who makes another method's configuration of one of `sp` empties them."""
    preset: Preset = "compact"
    precision: Precision = "fp32"
    """Of the LSTM's products over rollouts; on processors without products of bf16 they are of fp32."""
    encoder: EncoderName = "pooled"
    encoder_key: str = "pooled-1-g7"
    """Names the encoder's version and weights: actors with others are refused."""
    channels: int = 6
    """C, features of a grid cell of the encoder."""
    picture_size: int = PICTURE_SIZE
    """Side of the camera's picture, pixels."""
    zones: int = 8
    """K, zones of a graph."""
    edge_cost: EdgeCost = DEFAULT_EDGE_COST
    subgoal: Subgoal = "path"
    """Which zone the policy is guided to."""
    clustering: Clustering = "kmeans"
    """How views become zones."""
    merge_order: int | None = None
    """Seed of the order in which rooms are merged; None for ascending numbers."""
    graph_source: GraphSource = "rooms"
    """Where scene graphs have their nodes and edges from."""
    scenes: int = len(ROOM_SCENES)
    """S, scenes that the scene layer tells apart, the first ones of `SCENES`; runs in apartments need all of them."""
    seed: int = 0
    batch: int = 64
    """B, episodes that an actor runs at once."""
    rollout_steps: int = 20
    """T, steps of a rollout."""
    discount: float = 0.97
    gae_lambda: float = 0.95
    entropy_weight: float = 0.02
    value_weight: float = 0.5
    scene_weight: float = 0.1
    """Weight of the scene layer's cross-entropy."""
    imitation_weight: float = 1.0
    """Weight of the cross-entropy with the expert's actions, of methods that imitate; without effect on others."""
    approach_weight: float = 0.5
    """Weight at the start of the cross-entropy with the actions of shortest paths, once the target was seen."""
    approach_frames: int = 2_000_000
    """Frames over which that weight falls linearly to 0."""
    learning_rate: float = 1e-3
    """Adam's learning rate at the start; falls linearly to 0 over the budget, if there is one."""
    gradient_norm: float = 1.0
    """Largest norm of a gradient: actors scale larger ones down, and the learner refuses them."""
    learn_from: Source = "gradients"
    """What actors push: the gradients of their rollouts, or the rollouts, whose gradients the learner computes."""
    compress: Compression = "fp32"
    """How gradients travel."""
    parameters: ParametersForm = "full"
    """How parameters travel."""
    max_lag: int = 32
    """Largest policy lag, versions, at which a gradient is applied; see `most_lag` for rollouts."""
    minutes: float | None = None
    """Budget of training time, minutes."""
    frames: int | None = None
    """Budget of environment frames."""

    def __post_init__(self) -> None:
        """Check every field."""
        for name, value, known in (
            ("method", self.method, get_args(Method)),
            ("preset", self.preset, get_args(Preset)),
            ("precision", self.precision, get_args(Precision)),
            ("encoder", self.encoder, get_args(EncoderName)),
            ("edge cost", self.edge_cost, get_args(EdgeCost)),
            ("sub-goal", self.subgoal, get_args(Subgoal)),
            ("clustering", self.clustering, get_args(Clustering)),
            ("source of graphs", self.graph_source, get_args(GraphSource)),
            ("source to learn from", self.learn_from, get_args(Source)),
            ("compression", self.compress, get_args(Compression)),
            ("form of parameters", self.parameters, get_args(ParametersForm)),
            *(("layer", layer, get_args(Layer)) for layer in self.without),
        ):
            if value not in known:
                raise UnknownNameError.of(name, str(value), known)
        for name, low, high in _RANGES:
            value = getattr(self, name)
            if value is not None and not (low <= value <= high):
                message = f"'{name}' is {value}; it must be from {low:g} to {high:g}."
                raise InvalidValueError(message)
        if self.minutes is not None and self.frames is not None:
            message = "A run's budget is either minutes or frames; give one of them."
            raise InvalidValueError(message)
        if self.learn_from == "rollouts" and self.compress != "fp32":
            message = f"Rollouts are no gradients: leave out '{self.compress}' compression, or learn from gradients."
            raise InvalidValueError(message)
        if "sp" in METHODS[self.method].layers and not self.relations:
            object.__setattr__(self, "relations", shipped_relations())
        if "sp" not in METHODS[self.method].layers and self.relations:
            message = f"Method {self.method} has no graph of related categories: leave 'relations' empty, or take 'sp'."
            raise InvalidValueError(message)
        check_relations(self.relations)

    @property
    def policy(self) -> PolicySettings:
        """The settings of the policy network."""
        return PolicySettings.of(
            self.method,
            self.preset,
            channels=self.channels,
            zones=self.zones,
            scenes=self.scenes,
            without=self.without,
            relations=self.relations,
            precision=self.precision,
        )

    def tells(self, scene: str) -> bool:
        """Say whether the policy can be trained in a scene: its scene layer, if it has one, needs an output for it."""
        return not self.policy.scene_layer or scene in SCENES[: self.scenes]

    @property
    def merging(self) -> Merging:
        """How room graphs become scene graphs."""
        return Merging(self.merge_order, self.graph_source, self.seed)

    @property
    def most_lag(self) -> int:
        """Largest policy lag of a push that is applied, versions.

        N actors in turns push gradients at a lag of N - 1. Of rollouts each has another one acted already, which makes
        2 N - 1, and V-trace corrects for it: as many actors as with gradients may take part.
        """
        return self.max_lag if self.learn_from == "gradients" else 2 * self.max_lag + 1

    def approach_weight_at(self, version: int) -> float:
        """Return the weight of what is imitated of shortest paths, at a parameter version.

        A version is an update, which is of T * B frames, less those between episodes; so actors, learners and replays
        know the weight without being told.
        """
        frames = version * self.rollout_steps * self.batch
        return self.approach_weight * max(0.0, 1.0 - frames / self.approach_frames)

    def to_json(self) -> dict[str, Any]:
        """Return the configuration as JSON values."""
        return asdict(self) | {"without": list(self.without), "relations": list(self.relations)}

    def distinguishing(self) -> dict[str, Any]:
        """Return the fields that tell this run from others, as JSON values.

        Fields that came later are left out where they say what was done before, so that a digest of this stays the same
        when a field is added.
        """
        return {name: value for name, value in self.to_json().items() if name not in _LATER or value != _LATER[name]}

    @classmethod
    def from_json(cls, values: object) -> "RunConfig":
        """Read a configuration.

        Args:
            values: What `to_json` returned, perhaps by way of a file or the network. No older run's will do: its
                network had fewer parameters than this version's.

        Raises:
            InvalidValueError: A field is missing, unknown, of the wrong type or out of range.
            UnknownNameError: A value of a field with named values does not exist.
        """
        known = {field.name: field for field in fields(cls)}
        if not isinstance(values, dict) or set(values) != set(known):
            given = set(values) if isinstance(values, dict) else set()
            wrong = ", ".join(sorted(str(name) for name in given ^ set(known))) or "all"
            message = (
                f"The configuration is not of this version of hoz-dist (missing or unknown: {wrong}); "
                "use the version that made it, or train anew."
            )
            raise InvalidValueError(message)
        for name, value in values.items():
            if not _fits(name, value, known[name].default):
                message = f"'{name}' of the configuration is {value!r}, which is of the wrong type."
                raise InvalidValueError(message)
        return cls(**(values | {name: tuple(values[name]) for name in ("without", "relations")}))

    def differences(self, other: "RunConfig") -> list[str]:
        """Name the fields in which two configurations differ, each as ``name: mine, other's``."""
        mine, theirs = self.to_json(), other.to_json()
        return [f"{name}: {mine[name]!r}, {theirs[name]!r}" for name in mine if mine[name] != theirs[name]]


def _fits(name: str, value: object, default: object) -> bool:
    """Tell whether a JSON value is of a field's type, which its default shows."""
    match name:
        case "minutes":
            return value is None or type(value) in {int, float}
        case "frames" | "merge_order":
            return value is None or type(value) is int
        case "without" | "relations":
            return isinstance(value, list) and all(type(name) is str for name in value)
    return type(value) is type(default) or (type(default) is float and type(value) is int)


_LATER: Final[dict[str, Any]] = {
    "precision": "fp32",
    "learn_from": "gradients",
    "compress": "fp32",
    "parameters": "full",
    "subgoal": "path",
    "clustering": "kmeans",
    "merge_order": None,
    "graph_source": "rooms",
    "scenes": len(ROOM_SCENES),
    "imitation_weight": 1.0,
    "approach_weight": 0.0,
    "approach_frames": 2_000_000,
    "relations": [],
}
"""Fields that came after the first runs, and what was done before there was a choice: a digest of the rest is still
the one under which `hoz-dist reproduce` keeps runs."""
_RANGES: Final = (
    ("channels", 1, 4096),
    ("picture_size", 16, 512),
    ("zones", 2, MAX_ZONES),
    ("scenes", len(ROOM_SCENES), len(SCENES)),
    ("merge_order", 0, 2**31 - 1),
    ("seed", 0, 2**31 - 1),
    ("batch", 1, 4096),
    # After an episode's end comes a step that only resets, so of two steps one is valid.
    ("rollout_steps", 2, 1000),
    ("discount", 0.0, 1.0),
    ("gae_lambda", 0.0, 1.0),
    ("entropy_weight", 0.0, 10.0),
    ("value_weight", 0.0, 10.0),
    ("scene_weight", 0.0, 10.0),
    ("imitation_weight", 0.0, 10.0),
    ("approach_weight", 0.0, 10.0),
    ("approach_frames", 1, 10**15),
    ("learning_rate", 1e-8, 1.0),
    ("gradient_norm", 1e-3, 1e6),
    ("max_lag", 0, 100_000),
    ("minutes", 0.01, 1e6),
    ("frames", 1, 10**15),
)
"""Field, least value, largest value."""
