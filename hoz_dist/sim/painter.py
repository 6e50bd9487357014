"""Renders a room's pictures, starting PyBullet only when the first one is asked for."""

from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Self

from hoz_dist.sim.pose_graph import PoseGraph, build_pose_graph
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
        """End the PyBullet world."""
        self.close()

    def close(self) -> None:
        """End the PyBullet world, if there is one; closing twice does nothing."""
        if self._camera is not None:
            self._camera.world.close()
            self._camera = None

    def pose_graph(self) -> PoseGraph:
        """Find the room's pose graph."""
        return build_pose_graph(self._eye().world)

    def paint(self, graph: PoseGraph, views: Sequence[int]) -> Frames:
        """Render M views.

        Args:
            graph: The room's pose graph.
            views: The views, [M].
        """
        frames = Frames.empty(len(views), self._size)
        camera = self._eye()
        for row, view in enumerate(views):
            frames.rgb[row], frames.depth[row], frames.segmentation[row] = camera.render(graph.pose(view))
        return frames

    def _eye(self) -> "Camera":
        """Return a camera in the room."""
        if self._camera is None:
            # PyBullet is not needed where a room's views are complete, and takes time to load.
            from hoz_dist.sim.camera import Camera  # noqa: PLC0415
            from hoz_dist.sim.world import World  # noqa: PLC0415

            self._camera = Camera(World(self._room), self._size)
        return self._camera
