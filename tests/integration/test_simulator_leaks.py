"""Opening and closing worlds, stores and environments leaves nothing behind."""

from pathlib import Path

import numpy as np
import pytest

from hoz_dist.sim.bullet import pybullet
from hoz_dist.sim.gym_env import ObjectNavEnv
from hoz_dist.sim.live import LiveViews
from hoz_dist.sim.painter import Painter
from tests.integration.seeing import KITCHEN, SIDE, TinyEncoder, small_rooms, small_store

pytestmark = pytest.mark.integration


def clients() -> int:
    """Count PyBullet's connected clients in this process."""
    return sum(bool(pybullet.isConnected(client)) for client in range(64))


def descriptors() -> int:
    """Count this process's open files."""
    return len(list(Path("/proc/self/fd").iterdir()))


def test_no_clients_and_file_descriptors_are_left(tmp_path: Path, cache: Path) -> None:
    def use() -> None:
        with Painter(small_rooms(KITCHEN), SIDE) as painter:
            painter.paint(painter.pose_graph(), [0])
        store = small_store(tmp_path)
        views = store.open(KITCHEN, TinyEncoder())
        store.frames(KITCHEN, np.array([0]))
        with LiveViews(TinyEncoder(), SIDE, rooms=small_rooms) as live:
            live.add_room(views)
            live.look(np.array([0, 5]))
        env = ObjectNavEnv("bathroom/1", live=True, cache=cache, picture_size=SIDE)
        env.reset(seed=0)
        env.close()

    use()
    before = (clients(), descriptors())
    for _ in range(5):
        use()
    assert (clients(), descriptors()) == before
    assert before[0] == 0


def test_an_error_while_rendering_ends_the_client(tmp_path: Path) -> None:
    def fail(done: int, total: int) -> None:
        raise ArithmeticError(done, total)

    before = clients()
    with pytest.raises(ArithmeticError):
        small_store(tmp_path).open(KITCHEN, TinyEncoder(), fail)
    assert clients() == before
    small_store(tmp_path).open(KITCHEN, TinyEncoder())  # the lock is free again
