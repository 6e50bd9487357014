"""Tables of results as Markdown, aligned so that they can be read as they are."""

import statistics
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from hoz_dist.reproduce.bootstrap import CONFIDENCE, REPLICATES, Interval
from hoz_dist.reproduce.budget import Budget
from hoz_dist.reproduce.outcome import METRICS
from hoz_dist.reproduce.row import BASELINES, Figures, Paper, Row, Table
from hoz_dist.reproduce.summary import RowSummary, Spread, of_one_seed

_NOTHING: Final = "-"
_METRICS: Final = ("SR", "SPL", "SAE", "SR, L>=5", "SPL, L>=5", "SAE, L>=5")
_ONE_SEED: Final = "†"
_JUDGED: Final = ("sr", "spl")
"""Metrics of which the sentence above the differences tells, and the tables by scene and by L*."""
_ALIKE_PP: Final = 2.0
"""An interval around 0 that goes no further says that two rows are alike, percent points."""
_BETTER: Final = "better"
_WORSE: Final = "worse"
_ALIKE: Final = f"alike within {_ALIKE_PP:g} points"
_UNKNOWN: Final = "not told apart"
_NOT_JUDGED: Final = "of one seed, so not judged"
_VERDICTS: Final = (_BETTER, _WORSE, _ALIKE, _UNKNOWN, _NOT_JUDGED)


def table_text(
    table: Table,
    budget: Budget,
    summaries: Mapping[str, RowSummary],
    command: str,
    unfinished: Mapping[str, tuple[int, int]],
) -> str:
    """Write a table's results as Markdown.

    Args:
        table: The table.
        budget: What every row got.
        summaries: By row; rows without results are left out.
        command: What made the results.
        unfinished: Number of results and of those wanted, by row that lacks some.
    """
    rows = [row for row in table.rows if row.name in summaries]
    lines = [f"# {table.title}", ""]
    if unfinished:
        lines += [_unfinished(table, unfinished), ""]
    if not rows:
        return "\n".join([*lines, "No results yet.", ""])
    lines += [_protocol(table, budget, summaries, command), ""]
    if table.note:
        lines += [table.note, ""]
    lines += _figures(rows, summaries)
    if table.alike:
        lines += ["", _spread_of_rows(table, summaries)]
    for reference in table.references:
        compared = [row for row in rows if reference in summaries[row.name].differences]
        if compared:
            lines += ["", f"## Differences from {reference}", "", *_verdicts(compared, reference, summaries), ""]
            lines += _differences(compared, reference, summaries)
            lines += ["", _kind(compared, reference, summaries)]
            lines += _where(compared, reference, summaries) if reference == table.references[0] else []
    return "\n".join([*lines, ""])


def _unfinished(table: Table, unfinished: Mapping[str, tuple[int, int]]) -> str:
    """Say in one line which rows lack results."""
    rows = []
    for row in table.rows:
        if row.name in unfinished:
            finished, wanted = unfinished[row.name]
            rows.append(f"{row.name} {'untested' if row.agent in BASELINES else f'{finished} of {wanted} seeds'}")
    return f"Unfinished: {', '.join(rows)}."


def _protocol(table: Table, budget: Budget, summaries: Mapping[str, RowSummary], command: str) -> str:
    one = next(iter(summaries.values()))
    frames = budget.frames(table.scenes) / 1e6
    single = ", of Oracle one" if any(row.agent == "oracle" for row in table.rows) else ""
    return (
        f"`{command}`: {frames:g}M frames for each training run; the checkpoint was chosen among the last "
        f"{budget.candidates} of {budget.checkpoints} on validation rooms. {one.episodes['all']} episodes in test rooms"
        f", {one.episodes.get('long', 0)} of them with L* >= 5; {budget.trials} trials{single}. Percent; ± is the "
        "standard deviation over seeds, of rows without several that over trials. The paper's figures are of AI2-THOR."
    )


def _figures(rows: Sequence[Row], summaries: Mapping[str, RowSummary]) -> list[str]:
    """Write means and deviations, and the paper's figures if it has any of these rows."""
    with_paper = any(row.paper is not None for row in rows)
    header = ["row", "seeds", *_METRICS]
    header += ["paper: SR/SPL/SAE", "paper, L>=5"] if with_paper else []
    cells = []
    for row in rows:
        summary = summaries[row.name]
        line = [row.name, str(len(summary.seeds)) if summary.seeds and row.agent not in BASELINES else "-"]
        for part in ("all", "long"):
            spreads = summary.spreads.get(part, {})
            line += [_spread(spreads.get(metric)) for metric in METRICS]
        paper = row.paper or Paper()
        line += [_of_paper(paper.all), _of_paper(paper.long)] if with_paper else []
        cells.append(line)
    return aligned(header, cells)


def _verdicts(compared: Sequence[Row], reference: str, summaries: Mapping[str, RowSummary]) -> list[str]:
    """Say in a line for each metric which trained rows are better and worse than the reference in long episodes."""
    lines = []
    for metric in _JUDGED:
        verdicts: dict[str, list[str]] = {}
        for row in compared:
            if row.agent not in BASELINES:
                interval = summaries[row.name].differences[reference].get("long", {}).get(metric)
                known = None if of_one_seed(row, reference, summaries) else interval
                verdicts.setdefault(_verdict(known), []).append(f"`{row.name}`")
        if verdicts:
            text = "; ".join(
                f"{verdict}: {', '.join(verdicts[verdict])}" for verdict in _VERDICTS if verdict in verdicts
            )
            lines.append(f"- {metric.upper()} of episodes with L* >= 5, against {reference}: {text}.")
    return lines


def _verdict(interval: Interval | None) -> str:
    """Say in words what an interval tells; None is one that leaves out how much another training would differ."""
    if interval is None:
        return _NOT_JUDGED
    if interval.low > 0:
        return _BETTER
    if interval.high < 0:
        return _WORSE
    return _ALIKE if interval.low >= -_ALIKE_PP and interval.high <= _ALIKE_PP else _UNKNOWN


def _where(compared: Sequence[Row], reference: str, summaries: Mapping[str, RowSummary]) -> list[str]:
    """Write the differences from the first reference by scene and by L*."""
    rows = [row for row in compared if row.agent not in BASELINES and summaries[row.name].where]
    if not rows:
        return []
    first = summaries[rows[0].name]
    groups = list(first.where)
    header = [f"{group} ({first.episodes[group]})" for group in groups]
    lines = ["", "By scene and L*; the number of episodes stands in brackets, and ranges with few are left out."]
    for metric in _JUDGED:
        cells = [
            [
                _marked(row, reference, summaries),
                *(_interval(summaries[row.name].where[group][metric]) for group in groups),
            ]
            for row in rows
        ]
        lines += ["", *aligned([metric.upper(), *header], cells)]
    return lines


def _marked(row: Row, reference: str, summaries: Mapping[str, RowSummary]) -> str:
    """Return a row's name, with a mark when its intervals leave out how much another training would differ."""
    return f"{row.name} {_ONE_SEED}" if of_one_seed(row, reference, summaries) else row.name


def _differences(compared: Sequence[Row], reference: str, summaries: Mapping[str, RowSummary]) -> list[str]:
    cells = []
    for row in compared:
        parts = summaries[row.name].differences[reference]
        line = [_marked(row, reference, summaries)]
        for part in ("all", "long"):
            line += [_interval(parts.get(part, {}).get(metric)) for metric in METRICS]
        cells.append(line)
    return aligned(["row", *_METRICS], cells)


def _kind(compared: Sequence[Row], reference: str, summaries: Mapping[str, RowSummary]) -> str:
    """Say what the intervals are of."""
    text = (
        f"Row minus {reference} in percent points, with {CONFIDENCE:.0%} intervals: {REPLICATES} bootstrap replicates "
        "over seeds, test rooms and episodes, always the same rooms and episodes for both. If an interval excludes 0, "
        "the sign of the difference is unlikely to be due to the choice of seeds or rooms; few seeds make it wide."
    )
    if any(of_one_seed(row, reference, summaries) for row in compared):
        text += f" {_ONE_SEED} One seed, here or there: the interval leaves out how much another training would differ."
    return text


def _spread_of_rows(table: Table, summaries: Mapping[str, RowSummary]) -> str:
    others = [one for name, one in summaries.items() if name not in table.references]
    if len(others) < 2:  # noqa: PLR2004 - no deviation of one
        return ""
    means = {metric: [one.spreads["all"][metric].mean for one in others] for metric in METRICS}
    figures = ", ".join(
        f"{metric.upper()} {statistics.fmean(values):.2f} ± {statistics.stdev(values):.2f}"
        for metric, values in means.items()
    )
    return f"Mean and standard deviation over the {len(others)} rows other than the reference: {figures}."


def _spread(spread: Spread | None) -> str:
    return _NOTHING if spread is None else f"{spread.mean:.1f} ± {spread.deviation:.1f}"


def _interval(interval: Interval | None) -> str:
    if interval is None:
        return _NOTHING
    return f"{interval.difference:+.1f} [{interval.low:+.1f}, {interval.high:+.1f}]"


def _of_paper(figures: Figures | None) -> str:
    return _NOTHING if figures is None else "/".join(f"{value:.2f}" for value in figures)


def aligned(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table with aligned columns, the first to the left, the others to the right."""
    cells = [list(header), *map(list, rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(header))]

    def line(row: Sequence[str]) -> str:
        first, *others = (
            cell.ljust(width) if not column else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        return f"| {' | '.join([first, *others])} |"

    rule = [":" + "-" * (widths[0] - 1), *("-" * (width - 1) + ":" for width in widths[1:])]
    return [line(cells[0]), line(rule), *map(line, cells[1:])]
