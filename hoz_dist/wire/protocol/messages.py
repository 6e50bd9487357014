"""The messages, frozen and checked when they are made.

Every message can be made only from values that may travel, so that a receiver never sees another one. What the wire
cannot know (the number of parameters, the epoch, how old a gradient may be) is the learner's to judge.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from hoz_dist.graph.checks import MAX_ZONES
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.message import (
    CATEGORIES,
    DIGEST,
    EDGES,
    EPISODES,
    GRAPH_BYTES,
    MAX_EPISODES,
    MAX_FRAMES,
    MAX_PARAMETERS,
    NAME,
    NODES,
    ROOM,
    ROOM_DIGEST,
    SCENE,
    SHARD_ELEMENTS,
    SMALL_BYTES,
    VECTOR,
    ZONE,
    Message,
    Served,
    check_graph,
)
from hoz_dist.wire.protocol.rejection import LONGEST_DETAIL, Reason, RejectedError
from hoz_dist.wire.protocol.schema import Counts, Int, JsonObject, Many, OneOf, Real, Record, Structure, Tensor, Text


@dataclass(frozen=True, eq=False)
class Push(Message):
    """Base of what an actor pushes; ``(actor, incarnation, sequence)`` tells a repetition from a new message.

    Attributes:
        actor: Name of the actor, the last part of the key of its gradients.
        incarnation: Random number that an actor process draws when it starts.
        sequence: Counts the pushes of this incarnation and kind, from 0.
    """

    actor: Annotated[str, NAME]
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
    MOST_BYTES: ClassVar[int] = 4 * MAX_PARAMETERS + SMALL_BYTES

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]
    frames: Annotated[int, Int(1, MAX_FRAMES)]
    gradient: Annotated[NDArray[np.float32], VECTOR]


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
    MOST_BYTES: ClassVar[int] = 128 * MAX_EPISODES + SMALL_BYTES
    MOST_VALUES: ClassVar[int] = 16 * MAX_EPISODES

    episodes: Annotated[tuple[EpisodeResult, ...], EPISODES]
    policy_loss: Annotated[float, Real()] = 0.0
    value_loss: Annotated[float, Real()] = 0.0
    entropy: Annotated[float, Real()] = 0.0
    scene_loss: Annotated[float, Real()] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for episode in self.episodes:
            if episode.room.split != "train":
                raise RejectedError(Reason.SPLIT, f"{episode.room} is kept for validation or test")


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

    MOST_BYTES: ClassVar[int] = GRAPH_BYTES

    room: Annotated[RoomId, ROOM]
    digest: Annotated[str, ROOM_DIGEST]
    categories: Annotated[tuple[str, ...], CATEGORIES]
    nodes: Annotated[NDArray[np.float64], NODES]
    edges: Annotated[NDArray[np.float64], EDGES]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_graph(self.nodes, self.edges, self.categories)


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
    detail: Annotated[str, Text(LONGEST_DETAIL)]
    epoch: Annotated[int, Int()] = 0

    @classmethod
    def of(cls, error: RejectedError, epoch: int) -> "Refused":
        """Return the refusal of a message that the learner of an epoch rejects."""
        return cls(error.reason.value, error.detail, epoch)


PushReply = Accepted | Busy | Refused


@dataclass(frozen=True, eq=False)
class ParametersHead(Message):
    """Which parameters are the newest.

    Attributes:
        epoch: Grows by one whenever a learner starts.
        version: Number of updates applied to the parameters; never falls within an epoch.
        digest: xxh3_64 of the little-endian f32 vector, 16 hexadecimal digits.
        size: P, the number of parameters.
        shards: Number of shards that the vector is served in, of `SHARD_ELEMENTS` but the last.
    """

    KIND: ClassVar[str] = "parameters"

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]
    digest: Annotated[str, DIGEST]
    size: Annotated[int, Int(1, MAX_PARAMETERS)]
    shards: Annotated[int, Int(1)]

    def __post_init__(self) -> None:
        super().__post_init__()
        shards = -(-self.size // SHARD_ELEMENTS)
        if self.shards != shards:
            raise RejectedError(Reason.RANGE, f"shards is {self.shards}; {self.size} parameters have {shards}")

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
    MOST_BYTES: ClassVar[int] = 4 * SHARD_ELEMENTS + SMALL_BYTES

    head: Annotated[ParametersHead, Record(ParametersHead)]
    shard: Annotated[int, Int()]
    values: Annotated[NDArray[np.float32], Tensor("float32", rank=1, most=SHARD_ELEMENTS)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shard >= self.head.shards:
            raise RejectedError(Reason.RANGE, f"shard is {self.shard}, and there are {self.head.shards}")
        wanted = min(SHARD_ELEMENTS, self.head.size - self.shard * SHARD_ELEMENTS)
        if self.values.size != wanted:
            raise RejectedError(Reason.SHAPE, f"shard {self.shard} has {self.values.size} elements, not {wanted}")

    @property
    def epoch(self) -> int:
        """Epoch of the learner that serves it."""
        return self.head.epoch


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

    run: Annotated[str, NAME]
    epoch: Annotated[int, Int()]
    categories: Annotated[tuple[str, ...], CATEGORIES]
    config: Annotated[dict[str, Any], JsonObject()]


@dataclass(frozen=True, eq=False)
class SceneGraphReply(Served):
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
    MOST_BYTES: ClassVar[int] = GRAPH_BYTES

    scene: Annotated[str, SCENE]
    version: Annotated[int, Int()]
    rooms: Annotated[tuple[RoomId, ...], Many(ROOM, 1024)]
    categories: Annotated[tuple[str, ...], CATEGORIES]
    nodes: Annotated[NDArray[np.float64], NODES]
    edges: Annotated[NDArray[np.float64], EDGES]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_graph(self.nodes, self.edges, self.categories)
        if any(room.scene != self.scene for room in self.rooms):
            raise RejectedError(Reason.NAME, f"rooms has one that is no {self.scene}")
        if any(first.number >= second.number for first, second in pairwise(self.rooms)):
            raise RejectedError(Reason.RANGE, "rooms is not in ascending number")


@dataclass(frozen=True, eq=False)
class RoomGraphReply(RoomGraphFields, Served):
    """A room graph that the learner serves."""

    KIND: ClassVar[str] = "room_graph"


@dataclass(frozen=True, eq=False)
class PlanReply(Served):
    """A plan on a scene graph; zones are numbered from 0.

    Attributes:
        current: Zone that fits what is seen best.
        target: Zone where the target is likeliest.
        subgoal: Zone to go to next.
        path: Zones from current to target; one zone when they are the same.
        probability: Product of the path's edges.
    """

    KIND: ClassVar[str] = "plan"

    current: Annotated[int, ZONE]
    target: Annotated[int, ZONE]
    subgoal: Annotated[int, ZONE]
    path: Annotated[tuple[int, ...], Many(ZONE, MAX_ZONES)]
    probability: Annotated[float, Real(0.0, 1.0)]

    def __post_init__(self) -> None:
        super().__post_init__()
        ends = self.path[:1] + self.path[-1:]
        if ends != (self.current, self.target) or self.subgoal != self.path[:2][-1]:
            raise RejectedError(Reason.RANGE, "path does not lead from current by subgoal to target")


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

    role: Annotated[str, NAME]
    id: Annotated[str, NAME]
    host: Annotated[str, NAME]
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

    role: Annotated[str, NAME]
    id: Annotated[str, NAME]
    host: Annotated[str, NAME]
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
    MOST_VALUES: ClassVar[int] = 256 * 1024

    version: Annotated[int, Int()]
    epoch: Annotated[int, Int()]
    processes: Annotated[tuple[ProcessStatus, ...], Many(Record(ProcessStatus), 4096)]
    left: Annotated[tuple[LeftProcess, ...], Many(Record(LeftProcess), 256)]
    rejected: Annotated[dict[str, int], Counts()]
    details: Annotated[dict[str, Any], JsonObject()]
