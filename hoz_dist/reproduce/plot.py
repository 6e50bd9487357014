"""Pictures of a table's results."""

from collections.abc import Mapping, Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hoz_dist.reproduce.row import Row, Table
from hoz_dist.reproduce.summary import RowSummary, of_one_seed

_METRICS: Final = ("sr", "spl", "sae")
_PARTS: Final = ("all", "long")
_HEIGHT_OF_ROW: Final = 0.28
"""Inches."""
_LINEAR_PP: Final = 5.0
"""Differences up to this many percent points are drawn to scale, larger ones by their logarithm."""
_TICKS_PP: Final = (-50, -20, -5, -2, 0, 2, 5, 20, 50)


def table_figure(table: Table, summaries: Mapping[str, RowSummary]) -> Figure:
    """Draw the means of all rows and metrics, the paper's, and the differences from the first reference.

    Args:
        table: The table.
        summaries: By row; at least one.
    """
    rows = [row for row in table.rows if row.name in summaries][::-1]  # the first one at the top
    compared = table.references[0] in summaries and len(rows) > 1
    lines = 3 if compared else 2
    figure = Figure(figsize=(11.0, lines * (1.0 + _HEIGHT_OF_ROW * len(rows))), layout="constrained")
    figure.suptitle(table.title)
    axes = figure.subplots(lines, len(_METRICS), sharey=True)
    for part, of_part in zip(_PARTS, axes, strict=False):
        for metric, panel in zip(_METRICS, of_part, strict=True):
            _draw_means(panel, rows, summaries, part, metric)
    if compared:
        for metric, panel in zip(_METRICS, axes[-1], strict=True):
            _draw_differences(panel, rows, summaries, table.references[0], metric)
    axes[0, 0].set_yticks(range(len(rows)), [row.name for row in rows])
    axes[0, 0].legend(frameon=False, fontsize=8)
    return figure


def _draw_means(panel: Axes, rows: Sequence[Row], summaries: Mapping[str, RowSummary], part: str, metric: str) -> None:
    """Draw the mean of every row with its standard deviation over seeds, and the paper's."""
    panel.set(title=f"{metric.upper()}{'' if part == 'all' else ', L* >= 5'}, percent", xlim=(0, 100))
    panel.grid(visible=True, axis="x", color="0.9")
    known = [(place, summaries[row.name].spreads.get(part, {}).get(metric)) for place, row in enumerate(rows)]
    ours = [(place, spread.mean, spread.deviation) for place, spread in known if spread is not None]
    if ours:
        where, means, deviations = zip(*ours, strict=True)
        panel.errorbar(means, where, xerr=deviations, fmt="o", markersize=4, capsize=2, label="ours")
    papers = [(place, getattr(row.paper, part, None)) for place, row in enumerate(rows)]
    theirs = [(place, getattr(figures, metric)) for place, figures in papers if figures is not None]
    if theirs:
        where, values = zip(*theirs, strict=True)
        panel.plot(values, where, "x", color="0.5", markersize=5, label="paper, AI2-THOR")


def _draw_differences(
    panel: Axes, rows: Sequence[Row], summaries: Mapping[str, RowSummary], reference: str, metric: str
) -> None:
    """Draw every row's difference from a reference in long episodes with its interval, dashed if of one seed."""
    panel.set(title=f"{metric.upper()}, L* >= 5, less that of {reference}, 95% intervals")
    panel.set_xlabel(f"percent points; to scale up to {_LINEAR_PP:g}, then logarithmic", fontsize=8)
    panel.title.set_fontsize(8)
    panel.set_xscale("symlog", linthresh=_LINEAR_PP)
    panel.set_xticks(_TICKS_PP, [f"{tick:+d}" if tick else "0" for tick in _TICKS_PP], fontsize=8)
    panel.set_xlim(-100.0, 100.0)
    panel.grid(visible=True, axis="x", color="0.9")
    panel.axvline(0.0, color="0.5", linewidth=0.8)
    for place, row in enumerate(rows):
        interval = summaries[row.name].differences.get(reference, {}).get("long", {}).get(metric)
        if interval is not None:
            of_one = of_one_seed(row, reference, summaries)
            panel.plot((interval.low, interval.high), (place, place), "--" if of_one else "-", color="C0")
            fill = "white" if of_one else "C0"
            panel.plot(interval.difference, place, "o", color="C0", markerfacecolor=fill, markersize=4)
