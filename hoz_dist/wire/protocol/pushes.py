"""What actors push; frozen, and checked when they are made.

Every message can be made only from values that may travel, so that a receiver never sees another one. What the wire
cannot know (the number of parameters, the epoch, how old a gradient may be) is the learner's to judge.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

from hoz_dist.gradient_forms import Gradient
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.wire.protocol.gradients import GradientField
from hoz_dist.wire.protocol.graph_messages import RoomGraphFields
from hoz_dist.wire.protocol.message import (
    EPISODES,
    MAX_EPISODES,
    MAX_FRAMES,
    MAX_PARAMETERS,
    NAME,
    SMALL_BYTES,
    Message,
)
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.schema import Int, Real

GRADIENT: Final = GradientField()


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
        gradient: In the order of the parameter vector, in the form of the run's codec; [P] f32 in full.
    """

    KIND: ClassVar[str] = "gradient"
    MOST_BYTES: ClassVar[int] = 4 * MAX_PARAMETERS + SMALL_BYTES
    BULK: ClassVar[bool] = True

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]
    frames: Annotated[int, Int(1, MAX_FRAMES)]
    gradient: Annotated[Gradient, GRADIENT]


@dataclass(frozen=True, eq=False)
class EpisodesPush(Push):
    """Finished episodes and how the actor gets on.

    Attributes:
        episodes: Results, in the order in which the episodes ended.
        policy_loss: Mean policy loss of its gradients since then.
        value_loss: Mean value loss, likewise.
        entropy: Mean entropy of the policy, nats, likewise.
        scene_loss: Mean cross-entropy of the scene layer, nats, likewise; 0 without the layer.
        imitation_loss: Mean cross-entropy with what a steering has imitated, nats, likewise; None if nothing is.
        approach_loss: Mean cross-entropy with the actions that begin a shortest path, where the target was seen, nats,
            likewise; None if the approach is not taught.
    """

    KIND: ClassVar[str] = "episodes"
    MOST_BYTES: ClassVar[int] = 128 * MAX_EPISODES + SMALL_BYTES
    MOST_VALUES: ClassVar[int] = 16 * MAX_EPISODES

    episodes: Annotated[tuple[EpisodeResult, ...], EPISODES]
    policy_loss: Annotated[float, Real()] = 0.0
    value_loss: Annotated[float, Real()] = 0.0
    entropy: Annotated[float, Real()] = 0.0
    scene_loss: Annotated[float, Real()] = 0.0
    imitation_loss: Annotated[float | None, Real()] = None
    approach_loss: Annotated[float | None, Real()] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for episode in self.episodes:
            if episode.room.split != "train":
                raise RejectedError(Reason.SPLIT, f"{episode.room} is kept for validation or test")


@dataclass(frozen=True, eq=False)
class RoomGraphPush(RoomGraphFields, Push):
    """A room graph that an actor has made."""

    KIND: ClassVar[str] = "room_graph_push"
