"""How simulations read: a table, or a picture."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import click
from rich.console import Console
from rich.table import Table

from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.setting import Prediction
from hoz_dist.viz.scaling import scaling_figure
from hoz_dist.viz.zones import png

_FILE_WIDTH: Final = 150
_LEGEND: Final = (
    "lag: parameter versions; age: from an actor's parameters to the update; stale: gradients refused for their lag; "
    "busy: times that a gradient is told to come again; learner: load of the thread that applies gradients."
)


class Row(NamedTuple):
    """What was simulated, what came of it, and how long that took, seconds."""

    design: str
    prediction: Prediction
    took: float


def picture(rows: Sequence[Row], costs: Costs) -> bytes:
    """Draw the speed of each design, and return the content of a PNG file."""
    curves: dict[str, list[tuple[int, float]]] = {}
    for row in rows:
        curves.setdefault(row.design, []).append((row.prediction.actors, row.prediction.frames_per_second))
    return png(scaling_figure(curves, f"{costs.preset} preset, {costs.parameters / 1e6:.2f}M parameters, simulated"))


def print_table(rows: Sequence[Row]) -> None:
    """Print what was predicted on standard output."""
    table = Table()
    table.add_column("design")
    for column in ("actors", "frames/s", "lag", "age", "stale", "busy", "learner", "to it", "from it"):
        table.add_column(column, justify="right")
    table.add_column("fullest")
    for row in rows:
        one = row.prediction
        table.add_row(
            row.design,
            f"{one.actors:,}",
            f"{one.frames_per_second:,.0f}",
            f"{one.lag:.1f}",
            f"{one.age:.2g} s",
            f"{one.stale:.0%}",
            f"{one.busy:.2f}",
            f"{one.apply_load:.0%}",
            f"{one.megabits_up:,.0f} Mbit/s",
            f"{one.megabits_down:,.0f} Mbit/s",
            one.bottleneck,
        )
    console = Console(highlight=False)
    (console if console.is_terminal else Console(highlight=False, width=_FILE_WIDTH)).print(table)
    click.echo(_LEGEND)
