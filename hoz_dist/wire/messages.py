"""The messages, frozen and checked when they are made.

Every message can be made only from values that may travel, so that a receiver never sees another one. What the wire
cannot know (the number of parameters, the epoch, how old a gradient may be) is the learner's to judge.
"""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.checks import MAX_ZONES, check_shapes, check_values
from hoz_dist.nav.categories import SCENES, TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.fields import EpisodeFields, RoomName
from hoz_dist.wire.keys import NAME_PATTERN
from hoz_dist.wire.rejection import Reason, RejectedError
from hoz_dist.wire.schema import Counts, Int, JsonObject, Many, OneOf, Real, Record, Structure, Tensor, Text

MAX_PARAMETERS: Final = 30_000_000
"""Largest number of policy parameters; three times the paper's sizes, and within Zenoh's largest message."""
MAX_EPISODES: Final = 4096
_SMALL: Final = 64 * 1024
_GRAPH: Final = 1024 * 1024

_NAME: Final = Text(64, NAME_PATTERN)
_DIGEST: Final = Text(64)
_SCENE: Final = OneOf(frozenset(SCENES))
_CATEGORIES: Final = Many(OneOf(frozenset(TARGETS)), len(TARGETS))
_VECTOR: Final = Tensor("float32", rank=1, most=MAX_PARAMETERS)
_NODES: Final = Tensor("float64", rank=2, most=MAX_ZONES * len(TARGETS), low=0.0, high=1.0)
_EDGES: Final = Tensor("float64", rank=2, most=MAX_ZONES**2, low=0.0, high=1.0)
_ZONE: Final = Int(0, MAX_ZONES - 1)
_ROOM: Final = RoomName()
_EPISODES: Final = Many(EpisodeFields(), MAX_EPISODES)


class Message(Structure):
    """Base of everything that travels.

    Attributes:
        KIND: Name on the wire.
        MOST_BYTES: Longest encoded form that is read at all.
    """

    KIND: ClassVar[str]
    MOST_BYTES: ClassVar[int] = _SMALL


@dataclass(frozen=True, eq=False)
class Push(Message):
    """Base of what an actor pushes; ``(actor, incarnation, sequence)`` tells a repetition from a new message.

    Attributes:
        actor: Name of the actor, the last part of the key of its gradients.
        incarnation: Random number that an actor process draws when it starts.
        sequence: Counts the pushes of this incarnation and kind, from 0.
    """

    actor: Annotated[str, _NAME]
    incarnation: Annotated[int, Int()]
    sequence: Annotated[int, Int()]


@dataclass(frozen=True, eq=False)
class GradientPush(Push):
    """A gradient.

    Attributes:
        epoch: Epoch of the parameters that it was computed on.
        version: Version of the parameters that it was computed on.
        frames: Environment steps that it was computed from.
        gradient: [P] f32, in the order of the parameter vector.
    """

    KIND: ClassVar[str] = "gradient"
    MOST_BYTES: ClassVar[int] = 4 * MAX_PARAMETERS + _SMALL

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]
    frames: Annotated[int, Int(1)]
    gradient: Annotated[NDArray[np.float32], _VECTOR]


@dataclass(frozen=True, eq=False)
class EpisodesPush(Push):
    """Finished episodes and how the actor gets on.

    Attributes:
        episodes: Results, in the order in which the episodes ended.
        policy_loss: Mean policy loss of its gradients since then.
        value_loss: Mean value loss, likewise.
        entropy: Mean entropy of the policy, nats, likewise.
        scene_loss: Mean cross-entropy of the scene layer, nats, likewise; 0 without the layer.
    """

    KIND: ClassVar[str] = "episodes"
    MOST_BYTES: ClassVar[int] = 128 * MAX_EPISODES + _SMALL

    episodes: Annotated[tuple[EpisodeResult, ...], _EPISODES]
    policy_loss: Annotated[float, Real()] = 0.0
    value_loss: Annotated[float, Real()] = 0.0
    entropy: Annotated[float, Real()] = 0.0
    scene_loss: Annotated[float, Real()] = 0.0


@dataclass(frozen=True, eq=False)
class RoomGraphFields(Structure):
    """What a room graph holds, pushed or served.

    Attributes:
        room: The room.
        digest: Digest of the room that was explored.
        categories: [N] names of the columns of ``nodes``.
        nodes: [K, N] f64 zone nodes, in [0, 1].
        edges: [K, K] f64 zone edges, in [0, 1].
    """

    MOST_BYTES: ClassVar[int] = _GRAPH

    room: Annotated[RoomId, _ROOM]
    digest: Annotated[str, _DIGEST]
    categories: Annotated[tuple[str, ...], _CATEGORIES]
    nodes: Annotated[NDArray[np.float64], _NODES]
    edges: Annotated[NDArray[np.float64], _EDGES]

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_graph(self.nodes, self.edges, self.categories)


@dataclass(frozen=True, eq=False)
class RoomGraphPush(RoomGraphFields, Push):
    """A room graph that an actor has made."""

    KIND: ClassVar[str] = "room_graph_push"


@dataclass(frozen=True, eq=False)
class Accepted(Message):
    """The push counts, now or because it already did; the newest parameters are those of this epoch and version."""

    KIND: ClassVar[str] = "accepted"

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]


@dataclass(frozen=True, eq=False)
class Busy(Message):
    """The learner of this epoch has too much to do; push again after a while."""

    KIND: ClassVar[str] = "busy"

    epoch: Annotated[int, Int()]


@dataclass(frozen=True, eq=False)
class Refused(Message):
    """The message does not count and must not be repeated; or the question cannot be answered.

    Attributes:
        reason: Why, by code.
        detail: A sentence for people.
        epoch: Epoch of the learner that says so; 0 when no learner said it.
    """

    KIND: ClassVar[str] = "refused"

    reason: Annotated[str, OneOf(frozenset(Reason))]
    detail: Annotated[str, Text(2048)]
    epoch: Annotated[int, Int()] = 0


PushReply = Accepted | Busy | Refused


@dataclass(frozen=True, eq=False)
class ParametersHead(Message):
    """Which parameters are the newest.

    Attributes:
        epoch: Grows by one whenever a learner starts.
        version: Number of updates applied to the parameters; never falls within an epoch.
        digest: xxh3_64 of the little-endian f32 vector, 16 hexadecimal digits.
        size: P, the number of parameters.
        shards: Number of shards that the vector is served in.
    """

    KIND: ClassVar[str] = "parameters"

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]
    digest: Annotated[str, _DIGEST]
    size: Annotated[int, Int(1, MAX_PARAMETERS)]
    shards: Annotated[int, Int(1, 1024)]

    @property
    def stamp(self) -> tuple[int, int]:
        """Epoch and version; a later one is greater."""
        return self.epoch, self.version


@dataclass(frozen=True, eq=False)
class ParametersShard(Message):
    """A part of the parameter vector.

    Attributes:
        head: The parameters that it is a part of.
        shard: Its number, from 0; the vector is the shards in order.
        values: f32, the part.
    """

    KIND: ClassVar[str] = "shard"
    MOST_BYTES: ClassVar[int] = 8 * 1024 * 1024 + _SMALL

    head: Annotated[ParametersHead, Record(ParametersHead)]
    shard: Annotated[int, Int(0, 1023)]
    values: Annotated[NDArray[np.float32], Tensor("float32", rank=1, most=2 * 1024 * 1024)]


@dataclass(frozen=True, eq=False)
class ConfigReply(Message):
    """All that an actor needs to join.

    Attributes:
        run: Name of the run.
        epoch: Epoch of the learner.
        categories: [N] target categories, in the order of the graphs' columns.
        config: The run's configuration, what JSON can hold.
    """

    KIND: ClassVar[str] = "config"

    run: Annotated[str, _NAME]
    epoch: Annotated[int, Int()]
    categories: Annotated[tuple[str, ...], _CATEGORIES]
    config: Annotated[dict[str, Any], JsonObject()]


@dataclass(frozen=True, eq=False)
class SceneGraphReply(Message):
    """A scene graph.

    Attributes:
        scene: The scene.
        version: Number of times that it was rebuilt.
        rooms: Names of the rooms that it merges, in ascending number.
        categories: [N] names of the columns of ``nodes``.
        nodes: [K, N] f64 zone nodes, in [0, 1].
        edges: [K, K] f64 zone edges, in [0, 1].
    """

    KIND: ClassVar[str] = "scene_graph"
    MOST_BYTES: ClassVar[int] = _GRAPH

    scene: Annotated[str, _SCENE]
    version: Annotated[int, Int()]
    rooms: Annotated[tuple[RoomId, ...], Many(_ROOM, 1024)]
    categories: Annotated[tuple[str, ...], _CATEGORIES]
    nodes: Annotated[NDArray[np.float64], _NODES]
    edges: Annotated[NDArray[np.float64], _EDGES]

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_graph(self.nodes, self.edges, self.categories)


@dataclass(frozen=True, eq=False)
class RoomGraphReply(RoomGraphFields, Message):
    """A room graph that the learner serves."""

    KIND: ClassVar[str] = "room_graph"


@dataclass(frozen=True, eq=False)
class PlanReply(Message):
    """A plan on a scene graph; zones are numbered from 0.

    Attributes:
        current: Zone that fits what is seen best.
        target: Zone where the target is likeliest.
        subgoal: Zone to go to next.
        path: Zones from current to target; one zone when they are the same.
        probability: Product of the path's edges.
    """

    KIND: ClassVar[str] = "plan"

    current: Annotated[int, _ZONE]
    target: Annotated[int, _ZONE]
    subgoal: Annotated[int, _ZONE]
    path: Annotated[tuple[int, ...], Many(_ZONE, MAX_ZONES)]
    probability: Annotated[float, Real(0.0, 1.0)]


@dataclass(frozen=True, eq=False)
class ProcessStatus(Structure):
    """A process that holds a live token.

    Attributes:
        role: ``learner``, ``standby`` or ``actor``.
        id: Its name.
        host: Name of the machine that it runs on.
        incarnation: Random number that it drew when it started; tells two processes of one name apart.
        rooms: Rooms that it trains in, as far as the learner knows.
        frames: Environment steps that it has contributed.
        frames_per_second: Its speed, as the learner measures it.
        lag: Mean policy lag of its recent gradients, as the learner measures it.
        rejected: Number of its messages that were rejected.
    """

    role: Annotated[str, _NAME]
    id: Annotated[str, _NAME]
    host: Annotated[str, _NAME]
    incarnation: Annotated[int, Int()]
    rooms: Annotated[tuple[str, ...], Many(Text(64), 256)] = ()
    frames: Annotated[int, Int()] = 0
    frames_per_second: Annotated[float, Real(0.0)] = 0.0
    lag: Annotated[float, Real(0.0)] = 0.0
    rejected: Annotated[int, Int()] = 0


@dataclass(frozen=True, eq=False)
class LeftProcess(Structure):
    """A process whose token is gone.

    Attributes:
        role: ``learner``, ``standby`` or ``actor``.
        id: Its name.
        host: Name of the machine that it ran on.
        incarnation: Random number that it drew when it started.
        seconds: How long ago its token went, seconds.
    """

    role: Annotated[str, _NAME]
    id: Annotated[str, _NAME]
    host: Annotated[str, _NAME]
    incarnation: Annotated[int, Int()]
    seconds: Annotated[float, Real(0.0)]


@dataclass(frozen=True, eq=False)
class StatusReply(Message):
    """Who takes part and how it goes.

    Attributes:
        version: Version of the newest parameters.
        epoch: Epoch of the learner.
        processes: Holders of a live token.
        left: Who held a token and does so no more, the last one first.
        rejected: Number of rejected messages by reason; reasons that never occurred are left out.
        details: More for people, what JSON can hold; none of its names is one of the above.
    """

    KIND: ClassVar[str] = "status"
    MOST_BYTES: ClassVar[int] = 4 * 1024 * 1024

    version: Annotated[int, Int()]
    epoch: Annotated[int, Int()]
    processes: Annotated[tuple[ProcessStatus, ...], Many(Record(ProcessStatus), 4096)]
    left: Annotated[tuple[LeftProcess, ...], Many(Record(LeftProcess), 256)]
    rejected: Annotated[dict[str, int], Counts()]
    details: Annotated[dict[str, Any], JsonObject()]


def _check_graph(nodes: NDArray[np.float64], edges: NDArray[np.float64], categories: tuple[str, ...]) -> None:
    """Judge whether nodes [K, N], edges [K, K] and categories [N] belong together."""
    if len(set(categories)) != len(categories):
        raise RejectedError(Reason.NAME, "a category occurs twice")
    try:
        check_shapes(nodes, edges, len(categories))
    except InvalidValueError as error:
        raise RejectedError(Reason.SHAPE, str(error)) from error
    try:
        check_values(nodes, edges)
    except InvalidValueError as error:
        raise RejectedError(Reason.RANGE, str(error)) from error
