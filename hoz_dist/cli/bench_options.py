"""Options that the benchmarks share, and how their results are printed."""

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click
from click.core import ParameterSource

from hoz_dist.bench.timing import LEAST_REPEATS
from hoz_dist.cli.options import echo_json, json_option
from hoz_dist.nav.rooms import SPLITS, RoomId, training_rooms

if TYPE_CHECKING:
    from rich.table import Table

    from hoz_dist.bench.report import Metric, Report

PRESETS: Final = ("compact", "medium", "paper")
COMPARED: Final = ("compact", "paper")
"""Presets that are measured when none is named: the least and the largest."""
CODECS: Final = ("fp32", "bf16", "int8", "topk")

repeats_option = click.option(
    "--repeats",
    type=click.IntRange(LEAST_REPEATS, 1000),
    default=LEAST_REPEATS,
    show_default=True,
    help="Measurements of each figure, of which the median counts; what is compared takes turns.",
)
preset_option = click.option(
    "--preset",
    "presets",
    type=click.Choice(PRESETS),
    multiple=True,
    default=COMPARED,
    show_default=True,
    help="Sizes of the network; may be repeated.",
)
compress_option = click.option(
    "--compress",
    "codecs",
    type=click.Choice(CODECS),
    multiple=True,
    default=CODECS,
    show_default="all",
    help="How the gradient travels; may be repeated.",
)
F = TypeVar("F", bound=Callable[..., Any])
_LEAST_WIDTH: Final = 118
"""Of a table, columns; names of figures are cut in narrower ones."""
Measure = Callable[..., "Mapping[str, Metric]"]


def benchmark_options(command: F, *, seconds: float = 1.0) -> F:
    """Give a command the options of every benchmark: ``--seconds``, ``--repeats`` and ``--json``.

    Args:
        command: The command.
        seconds: Default of ``--seconds``.
    """
    seconds_option = click.option(
        "--seconds",
        type=click.FloatRange(0.001, 600.0),
        default=seconds,
        show_default=True,
        help="Least length of one measurement, seconds.",
    )
    for option in (json_option, repeats_option, seconds_option):
        command = option(command)
    return command


def rooms_option(default: int) -> Callable[[F], F]:
    """Make the option that says how many rooms of a scene `first_rooms` takes."""
    return click.option(
        "--rooms",
        "most_rooms",
        type=click.IntRange(1, max(len(splits["train"]) for splits in SPLITS.values())),
        default=default,
        show_default=True,
        help="Training rooms of each scene to use; more take longer to get ready.",
    )


def first_rooms(names: Iterable[str], most: int) -> list[RoomId]:
    """Return the first training rooms of scenes, and rooms, each once.

    Raises:
        HozError: A name is not a scene or a training room.
    """
    return list(dict.fromkeys(room for name in names for room in training_rooms((name,))[:most]))


def show_metrics(metrics: "Mapping[str, Metric]", *, as_json: bool, more: "Mapping[str, str] | None" = None) -> None:
    """Print what the benchmark that runs found, with the machine and the command.

    Args:
        metrics: The figures.
        as_json: For scripts.
        more: What else it found, by name.
    """
    from rich.console import Console

    from hoz_dist.bench.report import Report, this_machine

    report = Report(metrics, this_machine(), command_line(click.get_current_context()))
    if as_json:
        echo_json(report.to_json() | dict(more or {}))
        return
    console = Console()
    console = Console(width=max(console.width, _LEAST_WIDTH))
    console.print(_table(report))
    for name, text in (more or {}).items():
        console.print(f"{name}: {text}", markup=False, highlight=False)
    console.print(", ".join(f"{name} {value}" for name, value in report.machine.items()), markup=False, highlight=False)


def command_line(context: click.Context) -> str:
    """Return the command that runs, with the options that were given, less ``--json``.

    Files and endpoints are left to the reader: they are of this machine.
    """
    words = [context.command_path]
    for option in context.command.params:
        given = option.name and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE
        if not given or not isinstance(option, click.Option) or option.name == "as_json":
            continue
        value = context.params[option.name or ""]
        for single in value if isinstance(value, tuple) else (value,):
            if option.is_flag:
                words.append(option.opts[0] if single else option.secondary_opts[0])
            elif isinstance(option.type, click.Path) or option.metavar == "ENDPOINT":
                words += [option.opts[0], option.metavar or "PATH"]
            else:
                words += [option.opts[0], str(single)]
    return " ".join(words)


def _table(report: "Report") -> "Table":
    from rich.table import Table

    table = Table(title=report.command, title_justify="left")
    table.add_column("figure", no_wrap=True)
    for name in ("median", "least", "largest"):
        table.add_column(name, justify="right")
    table.add_column("unit")
    table.add_column("limit", justify="right")
    table.add_column("median / limit", justify="right")
    for name, metric in report.metrics.items():
        share = f"{metric.median / metric.limit:.3g}" if metric.limit else "-"
        limit = "-" if metric.limit is None else _figure(metric.limit)
        figures = map(_figure, (metric.median, metric.min, metric.max))
        table.add_row(name, *figures, metric.unit, limit, share)
    return table


def _figure(value: float) -> str:
    """Write a figure with at least three digits."""
    return f"{value:,.0f}" if abs(value) >= 100 or value == int(value) else f"{value:.3g}"  # noqa: PLR2004
