import pytest

from hoz_dist.nav.episode import evaluation_cap, seen_pixels


def test_seen_pixels_scale_with_the_area_of_the_picture() -> None:
    assert seen_pixels(128) == 8
    assert seen_pixels(64) == 2
    assert seen_pixels(256) == 32


@pytest.mark.parametrize(
    ("scene", "cap"), [("kitchen", 100), ("living_room", 200), ("bedroom", 100), ("bathroom", 100), ("apartment", 500)]
)
def test_evaluation_caps_are_the_released_protocols(scene: str, cap: int) -> None:
    assert evaluation_cap(scene) == cap
