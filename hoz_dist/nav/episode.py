"""Episodes: what is asked of the agent, and what came of it."""

from typing import Final, NamedTuple

from hoz_dist.nav.rooms import RoomId

SUCCESS_DISTANCE_M: Final = 1.5
"""Largest horizontal distance from the camera to the nearest point of the target's box at success."""
SEEN_PIXELS: Final = 8
"""Least number of pixels of a seen object in a picture of `SEEN_PICTURE_SIZE`."""
SEEN_PICTURE_SIZE: Final = 128


def seen_pixels(picture_size: int) -> float:
    """Return the least number of pixels of a seen object in a square picture of that side, in proportion to area."""
    return SEEN_PIXELS * (picture_size / SEEN_PICTURE_SIZE) ** 2


def evaluation_cap(scene: str) -> int:
    """Return the number of actions after which an evaluation episode is truncated (released protocols)."""
    return {"living_room": 200, "apartment": 500}.get(scene, 100)


class Episode(NamedTuple):
    """A task: from a start pose in a room, find a target."""

    room: RoomId
    start: int
    """Index of the start pose in the room's pose graph."""
    target: int
    """Index of the target category."""
    optimal: int
    """L*: least number of actions, Done not counted, to a pose that would succeed."""


class EpisodeResult(NamedTuple):
    """How an episode went."""

    room: RoomId
    target: int
    success: bool
    actions: int
    """Number of actions taken, Done included."""
    moves: int
    """Number of MoveAhead actions among them."""
    said_done: bool
    """Whether the agent ended the episode; otherwise it was truncated."""
    optimal: int
    """L* of the episode."""
