"""Pictures of trajectories in a room, seen from above."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Rectangle
from numpy.typing import NDArray

from hoz_dist.evaluation.trace import EpisodeTrace
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import SUCCESS_DISTANCE_M, EpisodeResult
from hoz_dist.nav.pose import GRID_M
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.pose_graph import PoseGraph
from hoz_dist.sim.room import Item, Part, Room
from hoz_dist.sim.room_views import RoomViews

_OVERHEAD_M: Final = 2.0
"""What begins above this height, metres, such as the ceiling, would hide all else."""


class Trajectory(NamedTuple):
    """One episode's way through a room."""

    room: Room
    graph: PoseGraph
    views: NDArray[np.integer]
    """Views that were visited, the start first, [actions + 1]."""
    result: EpisodeResult
    agent: str
    """Who went this way."""


def trajectories_of(traces: Sequence[EpisodeTrace], rooms: Sequence[RoomViews], agent: str) -> list[Trajectory]:
    """Return what is to be drawn of traced episodes.

    Args:
        traces: The episodes.
        rooms: The rooms of the episodes.
        agent: Who went these ways.
    """
    graphs = {views.room: views.graph for views in rooms}
    return [
        Trajectory(load_room(result.room), graphs[result.room], views, result, agent) for result, views, _, _ in traces
    ]


def draw_trajectories(trajectories: Sequence[Trajectory], path: Path, columns: int = 4) -> None:
    """Draw trajectories side by side and write them as a PNG file.

    Args:
        trajectories: At least one.
        path: File to write, whatever its extension; its folder is made if need be.
        columns: Most of them in a row: two agents' ways in the same episodes, by turns, stand side by side in 2 or 4.
    """
    columns = min(columns, len(trajectories))
    rows = -(-len(trajectories) // columns)
    figure = Figure(figsize=(4.2 * columns, 4.4 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, trajectory in zip(axes, trajectories, strict=False):
        _draw(axis, trajectory)
    for axis in axes[len(trajectories) :]:
        axis.set_axis_off()
    figure.suptitle(
        "dot: start; star: end, green where the target was found; orange: the target; dotted: near enough for success",
        fontsize=9,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, format="png", dpi=110)


def _draw(axis: Axes, trajectory: Trajectory) -> None:
    room, graph, result = trajectory.room, trajectory.graph, trajectory.result
    target = TARGETS[result.target]
    parts = [part for item in room.items for part in item.parts if part.low[2] < _OVERHEAD_M]
    for part in sorted(parts, key=lambda part: part.high[2]):
        _draw_part(axis, part)
    for item in room.items:
        if item.category == target:
            _draw_target(axis, item)
    reachable = graph.positions * GRID_M
    axis.scatter(reachable[:, 0], reachable[:, 1], s=2, color="0.75", zorder=2)

    poses = [graph.pose(int(view)) for view in trajectory.views]
    x, z = np.array([pose.x for pose in poses]), np.array([pose.z for pose in poses])
    axis.plot(x, z, color="tab:blue", linewidth=1.6, zorder=4)
    yaw = np.deg2rad([pose.yaw for pose in poses])
    axis.quiver(x, z, np.sin(yaw), np.cos(yaw), color="tab:blue", scale=28, width=0.006, zorder=5)
    axis.plot(x[0], z[0], "o", color="black", markersize=7, zorder=6)
    axis.plot(x[-1], z[-1], "*", color="tab:green" if result.success else "tab:red", markersize=15, zorder=7)
    ending = "found" if result.success else ("wrong Done" if result.said_done else "time ran out")
    outcome = f"{ending} after {result.actions} actions (optimal {result.optimal})"
    axis.set_title(f"{trajectory.agent}: {target} in {room.room}\n{outcome}", fontsize=9)
    axis.set_xlim(-0.1, room.width + 0.1)
    axis.set_ylim(-0.1, room.depth + 0.1)
    axis.set_aspect("equal")
    axis.set_xlabel("x, m", fontsize=8)
    axis.set_ylabel("z, m", fontsize=8)
    axis.tick_params(labelsize=7)


def _draw_part(axis: Axes, part: Part) -> None:
    (x, z, _), (width, depth, _) = part.low, part.size
    # Paled, so that the way stands out.
    colour = tuple(0.5 + 0.5 * channel for channel in part.colour)
    axis.add_patch(Rectangle((x, z), width, depth, facecolor=colour, edgecolor="0.6", linewidth=0.3, zorder=1))


def _draw_target(axis: Axes, item: Item) -> None:
    (x0, z0, _), (x1, z1, _) = item.low, item.high
    width, depth, orange = x1 - x0, z1 - z0, "tab:orange"
    axis.add_patch(Rectangle((x0, z0), width, depth, facecolor=orange, edgecolor="black", zorder=3))
    axis.plot((x0 + x1) / 2, (z0 + z1) / 2, "x", color="black", markersize=6, zorder=3)
    reach = f"round,pad={SUCCESS_DISTANCE_M}"
    axis.add_patch(FancyBboxPatch((x0, z0), width, depth, reach, fill=False, linestyle=":", edgecolor=orange, zorder=3))
