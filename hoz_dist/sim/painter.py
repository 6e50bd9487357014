"""Renders a room's pictures, starting PyBullet only when the first one is asked for."""

from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from hoz_dist.sim.pose_graph import VIEWS_PER_POSITION, PoseGraph, build_pose_graph
from hoz_dist.sim.room import Room
from hoz_dist.sim.view_folder import Frames

if TYPE_CHECKING:
    from hoz_dist.sim.camera import Camera


class Painter:
    """Paints one room; a context manager that owns the PyBullet world."""

    def __init__(self, room: Room, picture_size: int) -> None:
        """Prepare to paint.

        Args:
            room: The room.
            picture_size: S, side of the square pictures in pixels.
        """
        self._room = room
        self._size = picture_size
        self._camera: Camera | None = None

    def __enter__(self) -> Self:
        """Return the painter itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the PyBullet world, if there is one."""
        if self._camera is not None:
            self._camera.world.close()
            self._camera = None

    @property
    def camera(self) -> "Camera":
        """A camera in the room."""
        if self._camera is None:
            # PyBullet is not needed where a room's views are complete, and takes time to load.
            from hoz_dist.sim.camera import Camera  # noqa: PLC0415
            from hoz_dist.sim.world import World  # noqa: PLC0415

            self._camera = Camera(World(self._room), self._size)
        return self._camera

    def pose_graph(self) -> PoseGraph:
        """Find the room's pose graph."""
        return build_pose_graph(self.camera.world)

    def paint(self, graph: PoseGraph, position: int) -> Frames:
        """Render the 16 views of a position."""
        camera, size = self.camera, self._size
        rgb = np.empty((VIEWS_PER_POSITION, size, size, 3), dtype=np.uint8)
        depth = np.empty((VIEWS_PER_POSITION, size, size), dtype=np.float16)
        segmentation = np.empty((VIEWS_PER_POSITION, size, size), dtype=np.uint8)
        for row in range(VIEWS_PER_POSITION):
            rgb[row], depth[row], segmentation[row] = camera.render(graph.pose(position * VIEWS_PER_POSITION + row))
        return Frames(rgb, depth, segmentation)
