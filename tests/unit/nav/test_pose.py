import math

import pytest

from hoz_dist.nav.pose import GRID_M, HEADINGS, YAWS, Pose


def test_headings_go_where_the_yaw_looks() -> None:
    # Yaw 0 looks along +z, 90 along +x; a diagonal step moves a whole cell along both axes.
    for yaw, (dx, dz) in zip(YAWS, HEADINGS, strict=True):
        assert math.isclose(math.atan2(dx, dz) % math.tau, math.radians(yaw))
        assert max(abs(dx), abs(dz)) == 1


@pytest.mark.parametrize(
    ("pose", "key"),
    [
        (Pose(1.5, -0.25, 45, 30), "1.50|-0.25|45|30"),
        (Pose(0.0, 2.0, 0, 0), "0.00|2.00|0|0"),
    ],
)
def test_key_is_the_released_state_key(pose: Pose, key: str) -> None:
    assert pose.key == key


def test_grid_coordinates_are_exact_in_binary() -> None:
    # x / 0.25 is then exact, and poses compare equal however they were computed.
    assert all((n * GRID_M) / GRID_M == n for n in range(-100, 100))
