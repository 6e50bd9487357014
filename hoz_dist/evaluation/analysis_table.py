"""The table of an analysis, for people: figures below each other, methods side by side."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final

from rich.table import Table

from hoz_dist.evaluation.analysis import FAILURES, Analysis, Rates, causes, phases, spl_budget, what_if, zone_figures
from hoz_dist.evaluation.episode_analysis import Cause
from hoz_dist.evaluation.learning_curve import LearningCurve, frames_to
from hoz_dist.evaluation.success_by_length import LENGTHS, success_by_length

CAUSE_NAMES: Final[dict[Cause, str]] = {
    Cause.SUCCESS: "success",
    Cause.WRONG_DONE_FAR: "wrong Done: in view, too far",
    Cause.WRONG_DONE_UNSEEN: "wrong Done: not in view",
    Cause.TIME_OUT_AT_TARGET: "time out: was at the target",
    Cause.LOST: "time out: seen, not reached",
    Cause.NEVER_SEEN: "time out: never seen",
}
"""How people call them."""
MILESTONES: Final = (50.0, 70.0)
"""Success rates whose frames are shown, percent."""
_NOTHING: Final = "-"

Row = tuple[str, list[str]]


def analysis_table(
    analyses: Sequence[Analysis], curves: Mapping[str, Sequence[LearningCurve]], title: str, caption: str
) -> Table:
    """Show all figures of methods; docs/analysis.md explains them.

    Args:
        analyses: The methods, of the same episodes.
        curves: Learning curves of each run of a method, by the method's name; may be empty.
        title: What stands above the table.
        caption: What stands below it.
    """
    table = Table(title=title, caption=caption)
    table.add_column("percent, if nothing else is said", no_wrap=True)
    for analysis in analyses:
        table.add_column(analysis.name, justify="right")
    sections: list[tuple[str, Iterable[Row]]] = [
        ("how episodes end", _cause_rows(analyses)),
        ("where SPL goes", _spl_rows(analyses)),
        ("SR / SPL if ...", _what_if_rows(analyses)),
        ("search and approach", _phase_rows(analyses)),
        ("zones, of actions", _zone_rows(analyses)),
        ("SR by L*, with 95% interval", _length_rows(analyses)),
        ("frames to a success rate", _frames_rows(analyses, curves)),
    ]
    for heading, rows in sections:
        shown = [(label, cells) for label, cells in rows if set(cells) != {_NOTHING}]
        if shown:
            table.add_section()
            table.add_row(heading, style="bold")
            for label, cells in shown:
                table.add_row(f"  {label}", *cells)
    return table


def _cause_rows(analyses: Sequence[Analysis]) -> Iterable[Row]:
    shares = [causes(analysis) for analysis in analyses]
    for cause in Cause:
        yield CAUSE_NAMES[cause], [f"{of[cause]:.1f}" for of in shares]


def _spl_rows(analyses: Sequence[Analysis]) -> Iterable[Row]:
    budgets = [spl_budget(analysis) for analysis in analyses]
    yield "SPL", [f"{budget.spl:.1f}" for budget in budgets]
    yield "lost in search, successes", [f"{budget.search:.1f}" for budget in budgets]
    yield "lost in approach, successes", [f"{budget.approach:.1f}" for budget in budgets]
    yield "lost by late Done, successes", [f"{budget.late_done:.1f}" for budget in budgets]
    yield "lost in failures", [f"{sum(budget.failures[cause] for cause in FAILURES):.1f}" for budget in budgets]


def _what_if_rows(analyses: Sequence[Analysis]) -> Iterable[Row]:
    cases = [what_if(analysis) for analysis in analyses]

    def cells(case: str) -> list[str]:
        def cell(rates: Rates) -> str:
            return f"{rates.sr:.1f} / {rates.spl:.1f}"

        return [cell(of[case]) for of in cases]

    yield "nothing changed", cells("as_it_is")
    yield "the search had no detours", cells("search")
    yield "the approach had no detours", cells("approach")
    yield "Done came at once", cells("done")
    yield "shortest path after first sight", cells("after_sight")


def _phase_rows(analyses: Sequence[Analysis]) -> Iterable[Row]:
    figures = [phases(analysis) for analysis in analyses]
    yield "saw the target", [f"{of.seen:.1f}" for of in figures]
    yield "actions until then (least)", [_against(of.search_actions, of.search_optimal) for of in figures]
    yield "succeeded, of those that saw it", [_number(of.success_when_seen) for of in figures]
    yield (
        "actions after, successes (least)",
        [_against(of.approach_actions, of.approach_optimal) for of in figures],
    )
    yield "of these, after Done was due", [_number(of.done_actions) for of in figures]
    yield "actions after first sight", [f"{of.actions_after_sight:.1f}" for of in figures]
    yield "actions to a view known before", [f"{of.revisits:.1f}" for of in figures]
    kinds: tuple[tuple[str, Callable[[int], dict[str, float]]], ...] = (
        ("search", lambda index: figures[index].search_kinds),
        ("approach", lambda index: figures[index].approach_kinds),
    )
    for phase, of_method in kinds:
        shares = [of_method(index) for index in range(len(figures))]
        for kind in shares[0]:
            yield f"{phase}: {_KIND_NAMES[kind]}", [f"{of[kind]:.1f}" for of in shares]


_KIND_NAMES: Final = {"moves": "moves", "blocked": "blocked moves", "turns": "turns", "looks": "looks up or down"}


def _zone_rows(analyses: Sequence[Analysis]) -> Iterable[Row]:
    figures = [zone_figures(analysis) for analysis in analyses]

    def cells(name: str) -> list[str]:
        return [_NOTHING if of is None else _number(getattr(of, name)) for of in figures]

    yield "graph of the right scene", cells("right_scene")
    yield "sub-goal is not the target zone", cells("subgoal_differs")
    yield "agent is in the target zone", cells("in_target_zone")
    yield "sub-goals an episode (number)", cells("subgoals")
    yield "sub-goals reached, of those left", cells("reached")


def _length_rows(analyses: Sequence[Analysis]) -> Iterable[Row]:
    by_method = [{part.least: part for part in success_by_length(analysis.trials)} for analysis in analyses]
    for least in LENGTHS:
        if least in by_method[0]:  # the methods have the same episodes
            parts = [bins[least] for bins in by_method]
            label = f"L* {parts[0].label} ({parts[0].episodes} episodes)"
            yield label, [f"{part.sr:.1f} [{part.low:.0f}, {part.high:.0f}]" for part in parts]


def _frames_rows(analyses: Sequence[Analysis], curves: Mapping[str, Sequence[LearningCurve]]) -> Iterable[Row]:
    for milestone in MILESTONES:
        cells = []
        for analysis in analyses:
            frames = [frames_to(curve, milestone) for curve in curves.get(analysis.name, ())]
            cells.append(", ".join("not reached" if f is None else f"{f / 1e6:.2f} M" for f in frames) or _NOTHING)
        yield f"SR {milestone:.0f}, each run", cells


def _number(value: float | None) -> str:
    return _NOTHING if value is None else f"{value:.1f}"


def _against(value: float | None, least: float | None) -> str:
    return _NOTHING if value is None else f"{value:.1f} ({least:.1f})"
