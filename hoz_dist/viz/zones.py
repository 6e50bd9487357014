"""Pictures of zones: a scene graph as a ring of zones, and a room from above with the zone of each view."""

import io
from typing import Final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Wedge
from numpy.typing import NDArray

from hoz_dist.graph.scene_graph import SceneGraph, top_objects
from hoz_dist.nav.pose import GRID_M, PITCHES, YAWS

Colour = tuple[float, float, float, float]

_QUALITATIVE: Final = 10
"""Zones that a palette of clearly different colours can tell apart."""
_STRENGTHS: Final = ListedColormap(colormaps["Greys"](np.linspace(0.2, 1.0, 256)))
"""From the weakest edge, still visible, to the strongest."""
_RING_INCHES: Final = 9.0
_LABEL_RADIUS: Final = 1.16
"""Where the list of a zone's objects stands; the ring has radius 1."""
_POSITION_RADIUS_M: Final = 0.46 * GRID_M
"""Of the disc drawn at a position, so that neighbours do not touch."""


def scene_graph_figure(graph: SceneGraph, top: int = 4) -> Figure:
    """Draw a scene graph: zones with the objects seen most often in them, and the strengths of their edges.

    Args:
        graph: The graph.
        top: Most objects to name per zone.
    """
    figure = Figure(figsize=(_RING_INCHES * 1.2, _RING_INCHES), layout="constrained")
    _draw_ring(figure.add_subplot(), graph, top)
    return figure


def room_figure(
    graph: SceneGraph, room: str, positions: NDArray[np.int16], labels: NDArray[np.int64], top: int = 4
) -> Figure:
    """Draw a scene graph and, next to it, a room from above with the zone of each of its views.

    Args:
        graph: The graph.
        room: Name of the room.
        positions: Grid coordinates of the room's positions, int16 [P, 2].
        labels: Zone of the graph of each view, int64 [V], V = 16 P.
        top: Most objects to name per zone.
    """
    figure = Figure(figsize=(_RING_INCHES * 2, _RING_INCHES), layout="constrained")
    ring, above = figure.subplots(1, 2)
    _draw_ring(ring, graph, top)
    _draw_room(above, room, positions, labels, graph.zones)
    return figure


def png(figure: Figure) -> bytes:
    """Return a figure as the content of a PNG file."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=100)
    return file.getvalue()


def zone_colours(zones: int) -> list[Colour]:
    """Return a colour (red, green, blue, alpha in [0, 1]) for each of K zones, the same in every picture."""
    palette = colormaps["tab10"] if zones <= _QUALITATIVE else colormaps["turbo"].resampled(zones)
    return [palette(zone) for zone in range(zones)]


def _draw_ring(axes: Axes, graph: SceneGraph, top: int) -> None:
    """Draw zones on a circle, their edges as chords that are wider and darker the stronger they are."""
    angles = np.pi / 2 - 2 * np.pi * np.arange(graph.zones) / graph.zones  # clockwise from the top
    points = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    first, second = np.triu_indices(graph.zones, k=1)
    strengths = graph.edges[first, second]
    scale = Normalize(*(strengths.min(), strengths.max()) if strengths.size else (0.0, 1.0))
    weakest_first = strengths.argsort()
    chords = np.stack([points[first], points[second]], axis=1)[weakest_first]
    share = np.asarray(scale(strengths[weakest_first]))
    axes.add_collection(LineCollection(list(chords), colors=_STRENGTHS(share), linewidths=0.5 + 4 * share, zorder=1))
    for zone, ((x, y), colour) in enumerate(zip(points, zone_colours(graph.zones), strict=True)):
        axes.scatter([x], [y], s=900, color=[colour], edgecolors="white", zorder=2)
        axes.text(x, y, str(zone), ha="center", va="center", color="white", weight="bold", zorder=3)
        objects = "\n".join(f"{name} {share:.2f}" for name, share in top_objects(graph, zone, top)) or "nothing seen"
        axes.text(
            x * _LABEL_RADIUS,
            y * _LABEL_RADIUS,
            objects,
            ha=("left", "center", "right")[1 - round(float(x))],
            va=("bottom", "center", "top")[1 - round(float(y**3))],
            fontsize=9,
        )
    axes.set(xlim=(-1.7, 1.7), ylim=(-1.5, 1.5), aspect="equal", title=_title(graph))
    axes.set_axis_off()
    axes.figure.colorbar(
        ScalarMappable(scale, _STRENGTHS), ax=axes, label="edge: share of pairs of views that are close", shrink=0.6
    )


def _draw_room(axes: Axes, room: str, positions: NDArray[np.int16], labels: NDArray[np.int64], zones: int) -> None:
    """Draw each view as the sector that it looks into: pitch 0 on the outside, 30 degrees down on the inside."""
    colours = np.array(zone_colours(zones))
    sectors = []
    half = 180 / len(YAWS)
    for x, z in positions * GRID_M:
        for yaw in YAWS:
            ahead = 90 - yaw  # matplotlib counts from +x anticlockwise, yaw from +z clockwise
            for ring in range(len(PITCHES), 0, -1):
                radius = _POSITION_RADIUS_M * ring / len(PITCHES)
                width = _POSITION_RADIUS_M / len(PITCHES)
                sectors.append(Wedge((x, z), radius, ahead - half, ahead + half, width=width))
    axes.add_collection(PatchCollection(sectors, facecolors=colours[labels], edgecolors="none"))
    for zone in np.unique(labels):
        axes.scatter([], [], color=[colours[zone]], label=f"zone {zone}")
    low, high = positions.min(axis=0) * GRID_M - GRID_M, positions.max(axis=0) * GRID_M + GRID_M
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x (m)", ylabel="z (m)")
    axes.set_title(f"{room} from above: the zone of each view, drawn where it looks")
    axes.legend(loc="upper left", bbox_to_anchor=(1, 1), frameon=False)


def _title(graph: SceneGraph) -> str:
    """Say what the picture shows."""
    rooms = f", {len(graph.rooms)} rooms" if graph.rooms else ""
    return f"Scene graph of {graph.scene}: {graph.zones} zones{rooms}, version {graph.version}"
