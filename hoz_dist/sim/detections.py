"""Ground-truth detections and success, read from segmentations."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import SUCCESS_DISTANCE_M, seen_pixels
from hoz_dist.sim.room import Room


class Detected(NamedTuple):
    """What M pictures show of the target categories."""

    detections: NDArray[np.float32]
    """Box (x0, y0, x1, y1) over picture size, y down from the top, and confidence 0 or 1, [M, N, 5].

    Of several seen instances the one with the largest area; zeros when none is seen.
    """
    success: NDArray[np.bool_]
    """Whether Done would succeed, [M, N]: any seen instance, not only the detected one, is close enough."""


class Detector:
    """Detects the targets of one room in its segmentations."""

    def __init__(self, room: Room) -> None:
        """Number the instances of target categories, those of one category next to each other.

        Args:
            room: The room that the segmentations show.
        """
        found = [(number, item) for number, item in enumerate(room.items) if item.category in TARGETS]
        found.sort(key=lambda entry: TARGETS.index(entry[1].category))
        self._count = len(found)
        self._label = np.zeros(256, dtype=np.uint8)
        for instance, (number, _) in enumerate(found):
            self._label[number + 1] = instance + 1
        categories = [TARGETS.index(item.category) for _, item in found]
        self._targets, self._first = np.unique(np.array(categories, dtype=np.int64), return_index=True)
        self._low = np.array([item.low[:2] for _, item in found]).reshape(-1, 2)
        self._high = np.array([item.high[:2] for _, item in found]).reshape(-1, 2)

    def detect(self, segmentation: NDArray[np.uint8], positions: NDArray[np.float64]) -> Detected:
        """Detect targets in M square pictures.

        Args:
            segmentation: Index of the room's item plus 1, 0 where there is nothing, [M, S, S].
            positions: Where the camera stood, (x, z) in metres, [M, 2].
        """
        pictures, side, _ = segmentation.shape
        detections = np.zeros((pictures, len(TARGETS), 5), dtype=np.float32)
        success = np.zeros((pictures, len(TARGETS)), dtype=np.bool_)
        if not self._count:
            return Detected(detections, success)
        area, box = self._measure(segmentation)
        seen = area >= seen_pixels(side)
        gap = np.maximum(self._low - positions[:, None], positions[:, None] - self._high).clip(min=0.0)
        # Coordinates are whole millimetres; the small allowance is for binary fractions only.
        close = np.hypot(gap[..., 0], gap[..., 1]) <= SUCCESS_DISTANCE_M + 1e-9
        success[:, self._targets] = np.logical_or.reduceat(seen & close, self._first, axis=1)
        # Ranks order instances by area, the first of equal ones on top; -1 when not seen.
        rank = np.where(seen, area * self._count + np.arange(self._count)[::-1], -1)
        top = np.maximum.reduceat(rank, self._first, axis=1)
        picture, category = np.nonzero(top >= 0)
        best = self._count - 1 - top[picture, category] % self._count
        detections[picture, self._targets[category], :4] = box[picture, best].astype(np.float32) / side
        detections[picture, self._targets[category], 4] = 1.0
        return Detected(detections, success)

    def _measure(self, segmentation: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Measure the area, [M, I], and the box in pixels, [M, I, 4], of each of the I instances.

        Works on runs of equal pixels along rows, of which there are far fewer than pixels.
        """
        pictures, side, _ = segmentation.shape
        # A column of nothing at the right ends every run within its row.
        labels = np.zeros((pictures, side, side + 1), dtype=np.uint8)
        self._label.take(segmentation, out=labels[..., :side])
        flat = labels.ravel()
        start = np.concatenate(([0], np.flatnonzero(flat[1:] != flat[:-1]) + 1))
        stop = np.append(start[1:], flat.size)
        label = flat[start]
        of_target = np.flatnonzero(label)
        start, length, label = start[of_target], (stop - start)[of_target], label[of_target]
        line, column = np.divmod(start, side + 1)
        picture, row = np.divmod(line, side)
        instance = picture * self._count + label - 1
        size = pictures * self._count
        area = np.zeros(size, dtype=np.int64)
        np.add.at(area, instance, length)
        low = np.full((2, size), side)
        high = np.zeros((2, size), dtype=np.int64)
        for axis, (first, last) in enumerate(((column, column + length), (row, row + 1))):
            np.minimum.at(low[axis], instance, first)
            np.maximum.at(high[axis], instance, last)
        box = np.stack([*low, *high], axis=1)
        return area.reshape(pictures, -1), box.reshape(pictures, -1, 4)
