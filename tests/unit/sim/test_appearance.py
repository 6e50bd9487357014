import numpy as np

from hoz_dist.nav.categories import TARGETS
from hoz_dist.sim.appearance import appearance

N = len(TARGETS)


def detect(*boxes: tuple[float, float, float, float]) -> np.ndarray[tuple[int, int, int], np.dtype[np.float32]]:
    detections = np.zeros((1, N, 5), dtype=np.float32)
    for target, corners in enumerate(boxes):
        detections[0, target] = (*corners, 1.0)
    return detections


def grid() -> np.ndarray[tuple[int, int, int, int], np.dtype[np.float16]]:
    return np.array([[[[1.0, 2.0], [3.0, 4.0]], [[10.0, 20.0], [30.0, 40.0]]]], dtype=np.float16)


def test_a_box_over_all_cells_averages_them() -> None:
    assert appearance(grid(), detect((0.0, 0.0, 1.0, 1.0)))[0, 0].tolist() == [2.5, 25.0]


def test_a_box_within_one_cell_takes_that_cell() -> None:
    looks = appearance(grid(), detect((0.6, 0.1, 0.7, 0.2), (0.1, 0.6, 0.2, 0.7)))
    assert looks[0, :2].tolist() == [[2.0, 20.0], [3.0, 30.0]]


def test_cells_weigh_by_the_area_under_the_box() -> None:
    # Three quarters of the box lie over the left upper cell, one quarter over the right upper one.
    assert appearance(grid(), detect((0.2, 0.0, 0.6, 0.4)))[0, 0].tolist() == [1.25, 12.5]


def test_what_is_not_seen_looks_like_nothing() -> None:
    looks = appearance(grid(), detect((0.0, 0.0, 1.0, 1.0)))
    assert looks.shape == (1, N, 2)
    assert looks.dtype == np.float16
    assert not looks[0, 1:].any()
