import numpy as np
import pytest
from numpy.typing import NDArray

from hoz_dist.nav.categories import TARGETS, category_index
from hoz_dist.nav.episode import SUCCESS_DISTANCE_M, seen_pixels
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.detections import Detector
from hoz_dist.sim.room import Item, Part, Room
from tests.unit.sim.making import box

SIDE = 128
CHAIR, SINK = category_index("Chair"), category_index("Sink")
ROOM = Room(
    RoomId("kitchen", 1),
    6.0,
    6.0,
    (
        box("Counter", (1.0, 1.0, 1.0), (3.0, 3.0, 0.5)),
        box("Chair", (0.5, 0.5, 1.0), (1.0, 1.0, 0.5)),
        box("Sink", (0.5, 0.5, 1.0), (5.0, 1.0, 0.5)),
        box("Chair", (0.5, 0.5, 1.0), (5.0, 5.0, 0.5)),
    ),
)
NEAR_FIRST_CHAIR = np.array([[1.0, 2.0]])


def picture(*rectangles: tuple[int, int, int, int, int]) -> NDArray[np.uint8]:
    """Draw (item, left, top, width, height) one over the other."""
    segmentation = np.zeros((1, SIDE, SIDE), dtype=np.uint8)
    for item, left, top, width, height in rectangles:
        segmentation[0, top : top + height, left : left + width] = item + 1
    return segmentation


def test_the_box_spans_the_pixels_with_y_down_from_the_top() -> None:
    found = Detector(ROOM).detect(picture((2, 32, 0, 64, 16)), NEAR_FIRST_CHAIR).detections
    assert found[0, SINK].tolist() == [0.25, 0.0, 0.75, 0.125, 1.0]
    assert np.delete(found[0], SINK, axis=0).max() == 0.0


def test_a_box_reaches_the_edges_and_an_object_in_two_pieces_is_one() -> None:
    found = Detector(ROOM).detect(picture((2, 0, 0, 4, 4), (2, 124, 124, 4, 4)), NEAR_FIRST_CHAIR).detections
    assert found[0, SINK].tolist() == [0.0, 0.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize(("pixels", "seen"), [(7, False), (8, True)])
def test_eight_pixels_are_seen(pixels: int, seen: bool) -> None:
    found = Detector(ROOM).detect(picture((1, 10, 10, pixels, 1)), NEAR_FIRST_CHAIR)
    assert bool(found.detections[0, CHAIR, 4]) is seen
    assert bool(found.success[0, CHAIR]) is seen


def test_pixels_of_two_instances_do_not_add_up() -> None:
    found = Detector(ROOM).detect(picture((1, 10, 10, 4, 1), (3, 50, 10, 4, 1)), NEAR_FIRST_CHAIR)
    assert not found.detections.any()
    assert not found.success.any()


def test_seen_pixels_are_in_proportion_to_the_picture() -> None:
    assert seen_pixels(64) == 2.0
    segmentation = np.zeros((1, 64, 64), dtype=np.uint8)
    segmentation[0, 5, 5:7] = 2
    assert Detector(ROOM).detect(segmentation, NEAR_FIRST_CHAIR).detections[0, CHAIR, 4] == 1.0


def test_the_largest_instance_is_detected_but_any_seen_one_succeeds() -> None:
    # The far chair fills more of the picture; the near one is what makes Done succeed.
    found = Detector(ROOM).detect(picture((1, 0, 0, 4, 4), (3, 64, 64, 32, 32)), NEAR_FIRST_CHAIR)
    assert found.detections[0, CHAIR].tolist() == [0.5, 0.5, 0.75, 0.75, 1.0]
    assert found.success[0, CHAIR]
    far_only = Detector(ROOM).detect(picture((3, 64, 64, 32, 32)), NEAR_FIRST_CHAIR)
    assert far_only.detections[0, CHAIR, 4] == 1.0
    assert not far_only.success[0, CHAIR]


def test_of_equally_large_instances_the_first_item_is_detected() -> None:
    found = Detector(ROOM).detect(picture((3, 0, 0, 16, 16), (1, 64, 64, 16, 16)), NEAR_FIRST_CHAIR)
    assert found.detections[0, CHAIR, :2].tolist() == [0.5, 0.5]


@pytest.mark.parametrize(
    ("x", "z", "close"),
    [
        (1.0, 1.25 + SUCCESS_DISTANCE_M, True),
        (1.0, 1.251 + SUCCESS_DISTANCE_M, False),
        (1.25 + 0.9, 1.25 + 1.2, True),
        (1.25 + 0.91, 1.25 + 1.2, False),
        (1.0, 1.0, True),
    ],
)
def test_success_is_measured_to_the_nearest_point_of_the_box(x: float, z: float, close: bool) -> None:
    found = Detector(ROOM).detect(picture((1, 10, 10, 20, 20)), np.array([[x, z]]))
    assert bool(found.success[0, CHAIR]) is close


def test_pictures_of_a_batch_do_not_mix() -> None:
    pictures = [picture((item, 8 * item, 4, 8, 8)) for item in (1, 2, 3, 0)]
    places = np.array([[1.0, 2.0], [5.0, 2.0], [3.0, 3.0], [3.0, 3.0]])
    detector = Detector(ROOM)
    together = detector.detect(np.concatenate(pictures), places)
    for row, segmentation in enumerate(pictures):
        alone = detector.detect(segmentation, places[row : row + 1])
        assert np.array_equal(together.detections[row], alone.detections[0])
        assert np.array_equal(together.success[row], alone.success[0])


def test_detections_agree_with_a_plain_count_over_random_pictures() -> None:
    rng = np.random.default_rng(0)
    items = tuple(
        Item(
            [*TARGETS, "Counter"][rng.integers(23)],
            (Part("box", (0.2, 0.2, 0.2), (*rng.random(2).round(2) * 4, 0.5), (0, 0, 0)),),
        )
        for _ in range(40)
    )
    room = Room(RoomId("kitchen", 1), 4.0, 4.0, items)
    segmentation = rng.integers(0, 41, size=(3, 32, 32), dtype=np.uint8)
    places = rng.random((3, 2)) * 4
    found = Detector(room).detect(segmentation, places)
    for row in range(3):
        for target, category in enumerate(TARGETS):
            best, succeeds = 0, False
            expected = np.zeros(5)
            for number, item in enumerate(items):
                y, x = np.nonzero(segmentation[row] == number + 1)
                if item.category != category or len(x) < seen_pixels(32):
                    continue
                gap = [max(item.low[a] - places[row, a], places[row, a] - item.high[a], 0.0) for a in (0, 1)]
                succeeds |= float(np.hypot(*gap)) <= SUCCESS_DISTANCE_M
                if len(x) > best:
                    best = len(x)
                    expected = np.array([x.min(), y.min(), x.max() + 1, y.max() + 1, 32]) / 32
            assert np.array_equal(found.detections[row, target], expected.astype(np.float32))
            assert found.success[row, target] == succeeds


def test_a_room_without_targets_shows_none() -> None:
    room = Room(RoomId("kitchen", 1), 1.0, 1.0, (box("Counter", (1.0, 1.0, 1.0), (0.5, 0.5, 0.5)),))
    found = Detector(room).detect(np.ones((2, 32, 32), dtype=np.uint8), np.zeros((2, 2)))
    assert not found.detections.any()
    assert not found.success.any()
