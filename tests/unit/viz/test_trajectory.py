from pathlib import Path

import numpy as np
from matplotlib.image import imread

from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.viz.trajectory import Trajectory, draw_trajectories
from tests.unit.sim.making import open_grid, small_room

FRIDGE = TARGETS.index("Fridge")


def trajectory(*, success: bool) -> Trajectory:
    """An agent that walks straight on."""
    graph = open_grid(4, 6)
    views = [graph.view_of(graph.pose(0)._replace(z=0.25 * step)) for step in range(5)]
    result = EpisodeResult(RoomId("kitchen", 1), FRIDGE, success, 5, 4, said_done=True, optimal=4)
    return Trajectory(small_room(), graph, np.array(views), result, "hoz")


def test_every_trajectory_is_drawn_and_success_shows(tmp_path: Path) -> None:
    found, missed, both = (tmp_path / "new" / name for name in ("found.png", "missed.png", "both.tmp"))
    draw_trajectories([trajectory(success=True)], found)
    draw_trajectories([trajectory(success=False)], missed)
    draw_trajectories([trajectory(success=True), trajectory(success=False)], both)
    one, other, wide = (imread(path, format="png") for path in (found, missed, both))
    assert one.shape == other.shape
    assert (one != other).any()
    assert wide.shape[1] > 1.5 * one.shape[1]
