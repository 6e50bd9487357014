"""Pictures of how speed grows with the number of actors."""

from collections.abc import Mapping, Sequence
from typing import Final

from matplotlib.figure import Figure

_INCHES: Final = (7.5, 4.6)
_MARKERS: Final = "os^vDP"


def scaling_figure(curves: Mapping[str, Sequence[tuple[int, float]]], title: str) -> Figure:
    """Draw frames per second against the number of actors, both on logarithmic axes.

    Args:
        curves: Points (actors, frames per second) of each design, by its name; at least one.
        title: What they have in common.
    """
    figure = Figure(figsize=_INCHES, layout="constrained")
    axes = figure.add_subplot()
    for number, (name, points) in enumerate(curves.items()):
        axes.plot(*zip(*points, strict=True), marker=_MARKERS[number % len(_MARKERS)], markersize=4, label=name)
    fewest, speed = next(iter(curves.values()))[0]
    most = max(actors for points in curves.values() for actors, _ in points)
    axes.plot((fewest, most), (speed, speed * most / fewest), color="0.7", linestyle=":", label="linear")
    axes.set(xscale="log", yscale="log", xlabel="actors", ylabel="frames/s", title=title)
    axes.grid(visible=True, which="major", color="0.9")
    axes.legend(frameon=False)
    return figure
