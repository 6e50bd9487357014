"""Rollouts as they travel: by the rooms' digests and pose ids, from which a learner that holds the rooms sees it all.

About 18 bytes a frame, at any size of the policy and of the pictures.
"""

from dataclasses import dataclass
from enum import IntFlag
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.graph.checks import MAX_ZONES
from hoz_dist.nav.actions import NO_ACTION, Action
from hoz_dist.nav.categories import SCENES, TARGETS
from hoz_dist.nav.feedback import PREVIOUS_ACTIONS
from hoz_dist.nav.reward import STEP_REWARD, SUCCESS_REWARD
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.message import MAX_FRAMES, ROOM, ROOM_DIGEST, SCENE, SMALL_BYTES
from hoz_dist.wire.protocol.pushes import Push
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.schema import Int, Many, Record, Structure, Tensor

MAX_ROOMS: Final = 256
"""Rooms that one rollout may pass through; their indices are bytes."""
FRAME_BYTES: Final = 17
"""Bytes of one step of one episode in the tensors."""
_MOST: Final = 2 * MAX_FRAMES
"""Largest number of elements of a tensor, the row after the last step included."""


class Flag(IntFlag):
    """Bits of `Steps.flags`."""

    FIRST = 1
    """The first step of an episode."""
    TERMINATED = 2
    """The episode ended by itself at the step."""
    TRUNCATED = 4
    """The episode was cut off at the step."""
    VALID = 8
    """The action was taken; otherwise the step only began the next episode."""
    FRESH = 16
    """The local copy of the scene graph was made anew at the step."""


_OF_STEPS: Final = Flag.TERMINATED | Flag.TRUNCATED | Flag.VALID
"""What the row after the last step cannot have."""
_INDEX: Final = Tensor("uint8", rank=2, most=_MOST)
_VIEW: Final = Tensor("uint16", rank=2, most=_MOST)
_TARGET: Final = Tensor("uint8", rank=2, most=_MOST, high=len(TARGETS) - 1)
_FLAGS: Final = Tensor("uint8", rank=2, most=_MOST, high=sum(Flag))
_SCENE: Final = Tensor("uint8", rank=2, most=_MOST, high=len(SCENES) - 1)
_ZONE: Final = Tensor("uint8", rank=2, most=_MOST, high=MAX_ZONES - 1)
_ACTION: Final = Tensor("uint8", rank=2, most=_MOST, high=len(Action) - 1)
_PREVIOUS: Final = Tensor("uint8", rank=1, most=_MOST, high=PREVIOUS_ACTIONS - 1)
_REWARD: Final = Tensor("float32", rank=2, most=_MOST, low=STEP_REWARD, high=SUCCESS_REWARD)
_LOG_PROBABILITY: Final = Tensor("float32", rank=2, most=_MOST, high=0.0)


@dataclass(frozen=True, eq=False)
class RoomUsed(Structure):
    """A room that a rollout passed through.

    Attributes:
        room: The room, one to train in.
        digest: Digest of its content.
    """

    room: Annotated[RoomId, ROOM]
    digest: Annotated[str, ROOM_DIGEST]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.room.split != "train":
            raise RejectedError(Reason.SPLIT, f"{self.room} is kept for validation or test")


@dataclass(frozen=True, eq=False)
class GraphUsed(Structure):
    """A scene graph that the policy was guided by.

    Attributes:
        scene: The scene.
        epoch: Epoch of the learner that served it.
        version: Its version.
    """

    scene: Annotated[str, SCENE]
    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]


@dataclass(frozen=True, eq=False)
class Steps(Structure):
    """T steps of B episodes, which follow each other with a step between them that only begins the next one.

    Rows are steps, columns episodes. What the policy sees has one row more, for the observation after the last step.

    Attributes:
        room: [T + 1, B] u8, index in `TrajectoryPush.rooms`.
        view: [T + 1, B] u16, pose: (position * 8 + yaw / 45) * 2 + (1 if the camera looks down).
        target: [T + 1, B] u8, target category.
        flags: [T + 1, B] u8, see `Flag`.
        scene: [T + 1, B] u8, scene whose graph was used; 0 without the zone layer, as are the next two.
        current: [T + 1, B] u8, current zone.
        subgoal: [T + 1, B] u8, sub-goal zone.
        previous_action: [B] u8, action before the first step, as it was `hoz_dist.nav.feedback.felt`; 6 for none.
        action: [T, B] u8.
        reward: [T, B] f32.
        log_probability: [T, B] f32, of the action under the policy that acted; at most 0.
    """

    room: Annotated[NDArray[np.uint8], _INDEX]
    view: Annotated[NDArray[np.uint16], _VIEW]
    target: Annotated[NDArray[np.uint8], _TARGET]
    flags: Annotated[NDArray[np.uint8], _FLAGS]
    scene: Annotated[NDArray[np.uint8], _SCENE]
    current: Annotated[NDArray[np.uint8], _ZONE]
    subgoal: Annotated[NDArray[np.uint8], _ZONE]
    previous_action: Annotated[NDArray[np.uint8], _PREVIOUS]
    action: Annotated[NDArray[np.uint8], _ACTION]
    reward: Annotated[NDArray[np.float32], _REWARD]
    log_probability: Annotated[NDArray[np.float32], _LOG_PROBABILITY]

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_shapes()
        self._check_episodes()

    def has(self, flag: Flag) -> NDArray[np.bool_]:
        """Return where a flag is set, [T + 1, B]."""
        return (self.flags & flag).astype(np.bool_)

    def _check_shapes(self) -> None:
        steps, batch = self.action.shape
        expected = {
            **dict.fromkeys(("room", "view", "target", "flags", "scene", "current", "subgoal"), (steps + 1, batch)),
            **dict.fromkeys(("reward", "log_probability"), (steps, batch)),
            "previous_action": (batch,),
        }
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise RejectedError(Reason.SHAPE, f"{name} is {getattr(self, name).shape}; with that action {shape}")

    def _check_episodes(self) -> None:
        """Judge whether the steps can follow each other."""
        first, valid = self.has(Flag.FIRST), self.has(Flag.VALID)[:-1]
        terminated, truncated = self.has(Flag.TERMINATED)[:-1], self.has(Flag.TRUNCATED)[:-1]
        ended = terminated | truncated
        stays = (self.room[1:] == self.room[:-1]) & (self.target[1:] == self.target[:-1])
        checks = (
            ((self.flags[-1] & _OF_STEPS).any(), "the row after the last step has flags of a step"),
            ((terminated != (valid & (self.action == Action.DONE))).any(), "an episode is terminated by Done alone"),
            ((terminated & truncated).any(), "an episode is both terminated and truncated"),
            ((truncated & ~valid).any(), "an episode is truncated at a step that was not taken"),
            ((valid[1:] == ended[:-1]).any(), "a step is not taken just if an episode ended before it"),
            ((first[1:] == valid).any(), "an episode begins just after a step that was not taken"),
            ((first[0] & ~valid[0]).any(), "the first step of an episode is not taken"),
            ((first[0] != (self.previous_action == NO_ACTION)).any(), "only first steps have no previous action"),
            ((~first[1:] & ~stays).any(), "the room or target changes within an episode"),
        )
        for wrong, detail in checks:
            if wrong:
                raise RejectedError(Reason.RANGE, f"the steps do not fit together: {detail}")


@dataclass(frozen=True, eq=False)
class TrajectoryPush(Push):
    """A rollout. What the previous one of this incarnation ended with, it begins with: recurrent states do not travel.

    Attributes:
        epoch: Epoch of the parameters that were acted on.
        version: Version of the parameters that were acted on.
        rooms: The rooms that ``steps.room`` is an index of, each once.
        graphs: The scene graphs that ``steps.scene`` names, at most one of a scene; none without the zone layer.
        steps: What was done and seen.
    """

    KIND: ClassVar[str] = "trajectory"
    MOST_BYTES: ClassVar[int] = 2 * FRAME_BYTES * MAX_FRAMES

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]
    rooms: Annotated[tuple[RoomUsed, ...], Many(Record(RoomUsed), MAX_ROOMS)]
    graphs: Annotated[tuple[GraphUsed, ...], Many(Record(GraphUsed), len(SCENES))]
    steps: Annotated[Steps, Record(Steps)]

    def __post_init__(self) -> None:
        super().__post_init__()
        for what, names in (("room", [one.room for one in self.rooms]), ("scene", [one.scene for one in self.graphs])):
            if len(set(names)) != len(names):
                raise RejectedError(Reason.NAME, f"a {what} occurs twice")
        steps, rooms = self.steps, len(self.rooms)
        if steps.room.max() >= rooms:
            raise RejectedError(Reason.RANGE, f"steps.room has an index of {steps.room.max()}, of {rooms} rooms")
        if self.graphs and (steps.has(Flag.FIRST) & ~steps.has(Flag.FRESH)).any():
            raise RejectedError(Reason.RANGE, "an episode begins with the graph of the one before")

    @property
    def frames(self) -> int:
        """Number of actions taken."""
        return int(self.steps.has(Flag.VALID).sum())


def most_bytes(batch: int, steps: int) -> int:
    """Return the length of the longest rollout of a run, of ``steps`` steps of ``batch`` episodes, as a message."""
    return FRAME_BYTES * batch * (steps + 1) + SMALL_BYTES
