"""Observations rendered by PyBullet at every step: the check that stored views tell the truth."""

from collections.abc import Callable
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.appearance import appearance
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.detections import Detector
from hoz_dist.sim.painter import Painter
from hoz_dist.sim.pose_graph import PoseGraph
from hoz_dist.sim.room import Room
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_source import Sight


class _LiveRoom(NamedTuple):
    """One room of the source, in its own PyBullet client."""

    first_view: int
    graph: PoseGraph
    painter: Painter
    detector: Detector


class _Seen(NamedTuple):
    """What one view showed when it was last looked at."""

    features: NDArray[np.float16]
    detections: NDArray[np.float32]
    appearance: NDArray[np.float16]
    success: NDArray[np.bool_]


class LiveViews:
    """A `ViewSource` that renders, detects and encodes on every look; a context manager that owns its PyBullet worlds.

    Only legal moves, L* and the choice of starts come from the `RoomViews` that are added.
    """

    def __init__(self, encoder: VisualEncoder, picture_size: int, rooms: Callable[[RoomId], Room] = load_room) -> None:
        """Make a source without rooms.

        Args:
            encoder: Makes the features.
            picture_size: S, side of the square pictures in pixels.
            rooms: Gives the content of a room; the catalogue by default.
        """
        self._encoder = encoder
        self._size = picture_size
        self._load_room = rooms
        self._rooms: list[_LiveRoom] = []
        self._views = 0
        self._seen: dict[int, _Seen] = {}

    def __enter__(self) -> Self:
        """Return the source itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the PyBullet worlds."""
        self.close()

    def close(self) -> None:
        """End the PyBullet worlds; closing twice does nothing."""
        for room in self._rooms:
            room.painter.close()
        self._rooms.clear()

    def add_room(self, views: RoomViews) -> None:
        """Append a room and load it into a world of its own."""
        content = self._load_room(views.room)
        painter = Painter(content, self._size)
        self._rooms.append(_LiveRoom(self._views, views.graph, painter, Detector(content)))
        self._views += views.graph.views

    def look(self, views: NDArray[np.int64]) -> Sight:
        """Render views [...]."""
        self._seen = {view: self._render(view) for view in views.ravel().tolist()}
        seen = [self._seen[view] for view in views.ravel().tolist()]

        def gather(field: int) -> NDArray[np.float32]:
            rows = np.stack([entry[field] for entry in seen]).astype(np.float32)
            return rows.reshape(*views.shape, *rows.shape[1:])

        return Sight(gather(0), gather(1), gather(2))

    def succeeds(self, views: NDArray[np.int64], targets: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell from the pictures of views [M], which were looked at last, whether Done succeeds with targets [M]."""
        seen = [self._seen.get(view) or self._render(view) for view in views.tolist()]
        return np.array([entry.success[target] for entry, target in zip(seen, targets, strict=True)], dtype=np.bool_)

    def _render(self, view: int) -> _Seen:
        """Render one view and tell what it shows."""
        room = next(room for room in reversed(self._rooms) if room.first_view <= view)
        local = np.array([view - room.first_view])
        frames = room.painter.paint(room.graph, local.tolist())
        features = self._encoder.encode(frames.rgb, frames.depth.astype(np.float32))
        found = room.detector.detect(frames.segmentation, room.graph.places(local))
        looks = appearance(features, found.detections)
        return _Seen(features[0], found.detections[0], looks[0], found.success[0])
