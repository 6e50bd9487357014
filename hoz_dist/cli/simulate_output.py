"""How simulations read: a table, or a picture."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final, NamedTuple

import click
from rich.table import Table

from hoz_dist.cli.consoles import result_console
from hoz_dist.errors import InvalidValueError
from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.designs import Design
from hoz_dist.scaling.setting import Prediction
from hoz_dist.viz.scaling import scaling_figure
from hoz_dist.viz.zones import png

_LEGEND: Final = (
    "updates/s: versions of the parameters; lag: in versions; age: from an actor's parameters to the update; stale: "
    "gradients refused for their lag; busy: times that a push is told to come again; learner: load of the thread that "
    "applies gradients; to it, from it: Mbit/s over the learner's link."
)


class Row(NamedTuple):
    """What was simulated, what came of it, and how long that took, seconds."""

    design: Design
    prediction: Prediction
    took: float


def picture(rows: Sequence[Row], costs: Costs) -> bytes:
    """Draw the speed of each design, as far as it gets on, and return the content of a PNG file.

    Raises:
        InvalidValueError: None gets on with any number of actors.
    """
    curves: dict[str, list[tuple[int, float]]] = {}
    for row in rows:
        if row.prediction.gets_on:
            curves.setdefault(row.design.name, []).append((row.prediction.actors, row.prediction.frames_per_second))
    if not curves:
        message = "There is nothing to draw: all that was simulated stands still."
        raise InvalidValueError(message)
    return png(scaling_figure(curves, f"{costs.preset} preset, {costs.parameters / 1e6:.2f}M parameters, simulated"))


def to_json(rows: Sequence[Row], command: str, seed: int) -> dict[str, Any]:
    """Return all that was predicted, and from what, as JSON values."""
    designs = {row.design.name: row.design for row in rows}
    return {
        "command": command,
        "seed": seed,
        "designs": {
            name: {
                "costs": asdict(design.costs),
                "setting": {key: value for key, value in asdict(design.setting).items() if key != "actors"},
            }
            for name, design in designs.items()
        },
        "predictions": [
            {"design": row.design.name} | row.prediction.to_json() | {"took_seconds": round(row.took, 1)}
            for row in rows
        ],
    }


def print_table(rows: Sequence[Row]) -> None:
    """Print what was predicted on standard output."""
    table = Table()
    table.add_column("design")
    for column in ("actors", "frames/s", "updates/s", "lag", "age", "stale", "busy", "learner", "to it", "from it"):
        table.add_column(column, justify="right")
    table.add_column("fullest")
    for row in rows:
        one = row.prediction
        figures = (
            _figure(one.frames_per_second),
            _figure(one.updates_per_second),
            f"{one.lag:.1f}",
            f"{one.age:.2g} s",
            f"{one.stale:.0%}",
            f"{one.busy:.2f}",
        )
        table.add_row(
            row.design.name,
            f"{one.actors:,}",
            *(figures if one.gets_on else ("stands still", *["-"] * (len(figures) - 1))),
            f"{one.apply_load:.0%}",
            _figure(one.megabits_up),
            _figure(one.megabits_down),
            one.bottleneck,
        )
    result_console().print(table)
    click.echo(_LEGEND)
    if not all(row.prediction.gets_on for row in rows):
        click.echo("stands still: nothing that was pushed was answered for an hour of simulated time.")


def _figure(value: float) -> str:
    """Write a figure with at least two digits."""
    return f"{value:,.0f}" if value >= 10 or value == 0 else f"{value:.2g}"  # noqa: PLR2004
