"""`hoz-dist bench render`: pictures drawn, beside bare calls of PyBullet's renderer."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Final

import numpy as np

from hoz_dist.bench.report import Metric
from hoz_dist.bench.timing import Contender, Progress, core_seconds, rate, run_contests
from hoz_dist.nav.pose import CAMERA_HEIGHT_M, FIELD_OF_VIEW_DEG, Pose
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.bullet import pybullet
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.painter import Painter
from hoz_dist.sim.pose_graph import PoseGraph
from hoz_dist.sim.room import Room
from hoz_dist.sim.world import World

VIEWS: Final = 48
"""Views all over the room, drawn again and again; some show more than others, so all are drawn equally often."""
_NEAR_M: Final = 0.05
_FAR_M: Final = 20.0


def bench_render(
    name: RoomId, sizes: Sequence[int], *, seconds: float, repeats: int, progress: Progress
) -> dict[str, Metric]:
    """Measure views per second of a core: drawn, turned into arrays of metres and item numbers, and checked.

    The limit is PyBullet drawing the same views of the same room, with nothing done to what it returns.

    Args:
        name: The room.
        sizes: Sides of the square pictures, pixels; each once.
        seconds: Length of one measurement.
        repeats: Measurements of each figure.
        progress: Told how far the work is.
    """
    room = load_room(name)
    with Painter(room, sizes[0]) as painter:
        graph = painter.pose_graph()
    views = np.linspace(0, graph.views - 1, min(VIEWS, graph.views)).astype(int).tolist()
    contests = [partial(_drawing, room, graph, views, size, seconds) for size in sizes]
    samples = run_contests(contests, repeats, progress)
    return {
        f"render_views_per_second_{size}": Metric.of(
            samples[f"views of {size} pixels"], "views/s", samples[f"bare calls, {size} pixels"]
        )
        for size in sizes
    }


@contextmanager
def _drawing(
    room: Room, graph: PoseGraph, views: Sequence[int], size: int, seconds: float
) -> Iterator[Mapping[str, Contender]]:
    matrices = [_view_matrix(graph.pose(view)) for view in views]
    projection = pybullet.computeProjectionMatrixFOV(FIELD_OF_VIEW_DEG, 1.0, _NEAR_M, _FAR_M)
    with Painter(room, size) as painter, World(room) as world:

        def paint() -> None:
            painter.paint(graph, views)

        def draw() -> None:
            for matrix in matrices:
                pybullet.getCameraImage(
                    size,
                    size,
                    matrix,
                    projection,
                    shadow=0,
                    renderer=pybullet.ER_TINY_RENDERER,
                    physicsClientId=world.client,
                )

        yield {
            f"views of {size} pixels": lambda: rate(paint, seconds, core_seconds) * len(views),
            f"bare calls, {size} pixels": lambda: rate(draw, seconds, core_seconds) * len(views),
        }


def _view_matrix(pose: Pose) -> Sequence[float]:
    yaw, pitch = np.deg2rad(pose.yaw), np.deg2rad(pose.pitch)
    ahead = (np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), -np.sin(pitch))
    eye = (pose.x, pose.z, CAMERA_HEIGHT_M)
    matrix: Sequence[float] = pybullet.computeViewMatrix(
        eye, [float(e + a) for e, a in zip(eye, ahead, strict=True)], (0.0, 0.0, 1.0)
    )
    return matrix
