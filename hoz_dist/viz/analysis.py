"""Pictures of an analysis: causes of failure, success against L*, learning curves; methods beside each other."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from hoz_dist.evaluation.analysis import FAILURES, Analysis, causes
from hoz_dist.evaluation.analysis_table import CAUSE_NAMES
from hoz_dist.evaluation.episode_analysis import Cause
from hoz_dist.evaluation.learning_curve import LearningCurve, mean_curve
from hoz_dist.evaluation.success_by_length import success_by_length

_MARKERS: Final = "os^vDP*X"
_CAUSE_COLOURS: Final[dict[Cause, str]] = {
    Cause.WRONG_DONE_FAR: "#fdae61",
    Cause.WRONG_DONE_UNSEEN: "#d7191c",
    Cause.TIME_OUT_AT_TARGET: "#abd9e9",
    Cause.LOST: "#5e9fcf",
    Cause.NEVER_SEEN: "#2c4d8f",
}
"""Warm for a wrong Done, cold for time that ran out."""
_SIDESTEP: Final = 0.08
"""Between methods in one bin, so that their intervals do not hide each other."""


def failure_figure(analyses: Sequence[Analysis], rooms: str) -> Figure:
    """Draw the share of episodes that failed, a bar for each method, stacked by cause.

    Args:
        analyses: The methods.
        rooms: What the rooms are called, for the title.
    """
    figure = Figure(figsize=(4.4 + 0.9 * len(analyses), 4.6), layout="constrained")
    axes = figure.add_subplot(ylabel="failed episodes", title=f"Why episodes fail, {rooms}")
    names = [analysis.name for analysis in analyses]
    shares = [causes(analysis) for analysis in analyses]
    bottom = [0.0] * len(names)
    for cause in FAILURES:
        heights = [of[cause] for of in shares]
        axes.bar(names, heights, bottom=bottom, color=_CAUSE_COLOURS[cause], label=CAUSE_NAMES[cause], width=0.6)
        bottom = [low + height for low, height in zip(bottom, heights, strict=True)]
    axes.yaxis.set_major_formatter(PercentFormatter())
    axes.set_axisbelow(True)
    axes.grid(visible=True, axis="y", color="0.9")
    # Reversed, as the bars are stacked.
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1, 1), reverse=True)
    return figure


def length_figure(analyses: Sequence[Analysis], rooms: str) -> Figure:
    """Draw success against the length of the optimal path, with 95% intervals.

    Args:
        analyses: The methods.
        rooms: What the rooms are called, for the title.
    """
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    title = f"Success against optimal path, {rooms}"
    axes = figure.add_subplot(xlabel="L*, actions (episodes)", ylabel="success", title=title)
    for number, analysis in enumerate(analyses):
        bins = success_by_length(analysis.trials)
        places = [index + _SIDESTEP * (number - (len(analyses) - 1) / 2) for index in range(len(bins))]
        rates = [part.sr for part in bins]
        errors = [[part.sr - part.low for part in bins], [part.high - part.sr for part in bins]]
        marker = _MARKERS[number % len(_MARKERS)]
        axes.errorbar(places, rates, errors, marker=marker, markersize=5, capsize=3, label=analysis.name)
    bins = success_by_length(analyses[0].trials)  # the same episodes for all
    axes.set_xticks(range(len(bins)), [f"{part.label}\n({part.episodes})" for part in bins])
    axes.set_ylim(-2, 102)
    axes.yaxis.set_major_formatter(PercentFormatter())
    axes.grid(visible=True, color="0.9")
    axes.legend(frameon=False)
    return figure


def learning_figure(curves: Mapping[str, Sequence[LearningCurve]]) -> Figure:
    """Draw success on validation rooms against frames: the mean over a method's runs, and their range.

    Runs that have no frames in common are drawn one by one.

    Args:
        curves: Curves of each run of a method, by its name; at least one.
    """
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.add_subplot(xlabel="frames, millions", ylabel="success on validation rooms", title="Learning")
    for number, (name, of_runs) in enumerate(curves.items()):
        mean = mean_curve(of_runs)
        marker = _MARKERS[number % len(_MARKERS)]
        if mean is None:
            for run, curve in enumerate(of_runs, start=1):
                frames = np.array(curve.frames) / 1e6
                axes.plot(frames, curve.success, marker=marker, markersize=4, label=f"{name} (run {run})")
            continue
        frames = mean.frames / 1e6
        runs = "" if len(of_runs) == 1 else f" ({len(of_runs)} runs)"
        (line,) = axes.plot(frames, mean.mean, marker=marker, markersize=4, label=f"{name}{runs}")
        axes.fill_between(frames, mean.low, mean.high, color=line.get_color(), alpha=0.2, linewidth=0)
    axes.set_ylim(0, 100)
    axes.yaxis.set_major_formatter(PercentFormatter())
    axes.grid(visible=True, color="0.9")
    axes.legend(frameon=False)
    return figure
