"""Pictures of a table's results."""

from collections.abc import Mapping
from typing import Final

from matplotlib.figure import Figure

from hoz_dist.reproduce.row import Table
from hoz_dist.reproduce.summary import RowSummary

_PANELS: Final = (("all", "sr"), ("all", "spl"), ("all", "sae"), ("long", "sr"), ("long", "spl"), ("long", "sae"))
_HEIGHT_OF_ROW: Final = 0.28
"""Inches."""


def table_figure(table: Table, summaries: Mapping[str, RowSummary]) -> Figure:
    """Draw the mean of every row and metric with its standard deviation over trials and seeds, and the paper's.

    Args:
        table: The table.
        summaries: By row; at least one.
    """
    rows = [row for row in table.rows if row.name in summaries][::-1]  # the first one at the top
    figure = Figure(figsize=(10.0, 2 * (1.0 + _HEIGHT_OF_ROW * len(rows))), layout="constrained")
    figure.suptitle(table.title)
    axes = figure.subplots(2, 3, sharey=True)
    places = range(len(rows))
    for panel, (part, metric) in zip(axes.flat, _PANELS, strict=True):
        panel.set(title=f"{metric.upper()}{'' if part == 'all' else ', L* >= 5'}, percent", xlim=(0, 100))
        panel.set_yticks(places, [row.name for row in rows])
        panel.grid(visible=True, axis="x", color="0.9")
        known = [(place, summaries[row.name].spreads.get(part, {}).get(metric)) for place, row in enumerate(rows)]
        ours = [(place, spread.mean, spread.of_trials) for place, spread in known if spread is not None]
        if ours:
            where, means, deviations = zip(*ours, strict=True)
            panel.errorbar(means, where, xerr=deviations, fmt="o", markersize=4, capsize=2, label="ours")
        papers = [(place, getattr(row.paper, part, None)) for place, row in enumerate(rows)]
        theirs = [(place, getattr(figures, metric)) for place, figures in papers if figures is not None]
        if theirs:
            where, values = zip(*theirs, strict=True)
            panel.plot(values, where, "x", color="0.5", markersize=5, label="paper, AI2-THOR")
    axes[0, 0].legend(frameon=False, fontsize=8)
    return figure
