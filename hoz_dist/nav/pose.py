"""Poses of the agent: grid position, yaw and pitch."""

from typing import Final, NamedTuple

GRID_M: Final = 0.25
"""Distance between neighbouring grid positions, metres."""
YAWS: Final[tuple[int, ...]] = tuple(range(0, 360, 45))
"""Yaw angles, degrees; 0 looks along +z, 90 along +x."""
PITCHES: Final[tuple[int, ...]] = (0, 30)
"""Pitch angles, degrees down."""
VIEWS_PER_POSITION: Final = len(YAWS) * len(PITCHES)
"""View index within a room: ``(position * 8 + yaw index) * 2 + pitch index``."""
CAMERA_HEIGHT_M: Final = 1.58
FIELD_OF_VIEW_DEG: Final = 90.0
PICTURE_SIZE: Final = 64
"""Side of the camera's square pictures unless told otherwise, pixels; see docs/decisions/picture-size.md."""
AGENT_RADIUS_M: Final = 0.2
HEADINGS: Final[tuple[tuple[int, int], ...]] = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))
"""Grid steps (dx, dz) of MoveAhead, by index into `YAWS`."""


class Pose(NamedTuple):
    """A pose l = (x, z, yaw, pitch)."""

    x: float
    """Metres."""
    z: float
    """Metres."""
    yaw: int
    """Degrees, one of `YAWS`."""
    pitch: int
    """Degrees down, one of `PITCHES`."""

    @property
    def key(self) -> str:
        """The state key of the released offline data, ``x|z|rot|hor``."""
        return f"{self.x:.2f}|{self.z:.2f}|{self.yaw}|{self.pitch}"
