"""What the learner's core is told (events) and what it asks its shell to do (effects)."""

from dataclasses import dataclass

from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.wire.protocol.answers import Accepted, Busy, Refused
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.trajectories import TrajectoryPush
from learner.replay import UpdateRecord

# Events. `request` names the request that a `Reply` answers; the shell chooses it.


@dataclass(frozen=True, slots=True)
class GradientReceived:
    """An actor pushed a gradient."""

    request: int
    push: GradientPush


@dataclass(frozen=True, slots=True)
class EpisodesReceived:
    """An actor pushed finished episodes."""

    request: int
    push: EpisodesPush


@dataclass(frozen=True, slots=True)
class RoomGraphReceived:
    """An actor pushed a room graph."""

    request: int
    push: RoomGraphPush


@dataclass(frozen=True, slots=True)
class TrajectoryReceived:
    """An actor pushed a rollout to learn from."""

    request: int
    push: TrajectoryPush


@dataclass(frozen=True, slots=True)
class RoomOpened:
    """The views of a room are there."""

    views: RoomViews


@dataclass(frozen=True, slots=True)
class RoomUnusable:
    """The views of a room cannot be had, now or later."""

    room: RoomId
    detail: str


@dataclass(frozen=True, slots=True)
class Tick:
    """Time went by."""


Event = GradientReceived | EpisodesReceived | RoomGraphReceived | TrajectoryReceived | RoomOpened | RoomUnusable | Tick

# Effects.


@dataclass(frozen=True, slots=True)
class Reply:
    """Answer a request."""

    request: int
    answer: Accepted | Busy | Refused


@dataclass(frozen=True, slots=True)
class PublishParameters:
    """The parameters changed."""


@dataclass(frozen=True, slots=True)
class PublishGraph:
    """A room graph is new, and so its scene graph changed."""

    room: RoomId


@dataclass(frozen=True, slots=True)
class OpenRoom:
    """Get the views of a room, to learn from rollouts in it; asked for again while they are not there."""

    room: RoomId


@dataclass(frozen=True, slots=True)
class RecordUpdate:
    """Write an applied update to the record."""

    record: UpdateRecord


@dataclass(frozen=True, slots=True)
class SaveCheckpoint:
    """Save a checkpoint; one to keep is never deleted to make room for newer ones."""

    keep: bool


@dataclass(frozen=True, slots=True)
class Finish:
    """The budget is used up, or the recorded updates are all repeated; asked for once."""


Effect = Reply | PublishParameters | PublishGraph | OpenRoom | RecordUpdate | SaveCheckpoint | Finish
