"""`hoz-dist simulate`: what a run would do with more actors, hosts and links than there are."""

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click
from click.core import ParameterSource

from hoz_dist.cli.options import echo_json, force_option, json_option
from hoz_dist.errors import InvalidValueError

if TYPE_CHECKING:
    from hoz_dist.cli.progress import Progress
    from hoz_dist.scaling.costs import Costs

DEFAULT_ACTORS: Final = ("1,10,100,1000,10000",)
MOST_ACTORS: Final = 100_000
_MBIT: Final = click.FloatRange(0.001, 1e9)
_NOT_WITH_DESIGNS: Final = frozenset({"one_host", "learn_from", "compress", "parameters", "shards", "fan_out"})


@click.command("simulate")
@click.option(
    "--actors",
    multiple=True,
    metavar="N[,N...]",
    default=DEFAULT_ACTORS,
    help="Numbers of actor processes, up to 100,000; may be repeated.  [default: 1,10,100,1000,10000]",
)
@click.option("--preset", default="compact", show_default=True, help="Whose measured costs: compact or paper.")
@click.option(
    "--costs",
    type=click.Path(dir_okay=False, path_type=Path),
    multiple=True,
    metavar="FILE",
    help="Costs that `hoz-dist bench train --costs FILE` measured; give those of gradients and those of rollouts, or "
    "one of them.  [default: those shipped for the preset]",
)
@click.option(
    "--one-host",
    is_flag=True,
    help="All processes share the cores of one host, without a network. Default: the learner has a host, and each "
    "actor a core that nobody slows down.",
)
@click.option(
    "--cores",
    type=click.IntRange(1, 4096),
    default=8,
    show_default=True,
    help="Cores of the learner's host; of the one with --one-host.",
)
@click.option(
    "--latency",
    type=click.FloatRange(0.0, 10_000.0),
    default=0.1,
    show_default=True,
    metavar="MS",
    help="Of a message, one way, milliseconds.",
)
@click.option(
    "--bandwidth",
    type=_MBIT,
    default=10_000.0,
    show_default=True,
    metavar="MBIT",
    help="Of a host's link, Mbit/s.",
)
@click.option(
    "--learner-bandwidth",
    type=_MBIT,
    metavar="MBIT",
    help="Of the links of learners and relays, Mbit/s.  [default: as --bandwidth]",
)
@click.option("--learn-from", help="gradients or rollouts.  [default: what the costs were measured with]")
@click.option("--compress", help="fp32, bf16, int8 or topk.  [default: what the costs were measured with]")
@click.option("--parameters", help="full or delta.  [default: what the costs were measured with]")
@click.option(
    "--max-lag",
    type=click.IntRange(0, 100_000),
    default=32,
    show_default=True,
    help="As of `hoz-dist train`: the largest policy lag of a gradient that is applied.",
)
@click.option(
    "--gil",
    type=click.FloatRange(0.0, 1.0),
    metavar="SHARE",
    help="Share of the time of the learner's threads, beside that in the interpreter, in which they hold its lock. Not "
    "measured: try 0 and 1.  [default: as the costs say, 0.2]",
)
@click.option(
    "--shards",
    type=click.IntRange(1, 4096),
    default=1,
    show_default=True,
    metavar="S",
    help="Learners that share the parameters, each on a host. A design: there is one learner today.",
)
@click.option(
    "--fan-out",
    type=click.IntRange(2, MOST_ACTORS),
    metavar="F",
    help="Put relays, which hand on parameters and sum up gradients, between the learner and more than F actors; each "
    "has a host and up to F below it. A design: there are none today.  [default: none]",
)
@click.option(
    "--designs",
    is_flag=True,
    help="Compare designs: full gradients, small ones, rollouts, several learners, relays. Not with --one-host, "
    "--learn-from, --compress, --parameters, --shards and --fan-out.",
)
@click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.png",
    help="Draw frames per second against the number of actors into a PNG file.",
)
@force_option
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of everything random in the simulation.")
@json_option
def simulate_command(
    actors: tuple[str, ...],
    preset: str,
    costs: tuple[Path, ...],
    latency: float,
    bandwidth: float,
    learner_bandwidth: float | None,
    learn_from: str | None,
    compress: str | None,
    parameters: str | None,
    gil: float | None,
    plot: Path | None,
    seed: int,
    *,
    designs: bool,
    force: bool,
    as_json: bool,
    **setting: Any,
) -> None:
    """Predict the speed, policy lag and load of a run with any number of actors.

    A discrete-event simulation fed by measured costs; docs/scaling.md says how near it comes. 10,000 actors take a
    minute, or some where most of what they send is turned away.
    """
    from hoz_dist.atomic import check_writable, write_atomically
    from hoz_dist.cli.bench_options import command_line
    from hoz_dist.cli.progress import Progress
    from hoz_dist.cli.simulate_output import Row, picture, print_table, to_json
    from hoz_dist.scaling.costs import costs_of, shipped_costs
    from hoz_dist.scaling.designs import Design, described
    from hoz_dist.scaling.designs import designs as designs_of
    from hoz_dist.scaling.model import simulate
    from hoz_dist.scaling.setting import Setting

    numbers = _numbers(actors)
    if designs:
        _refuse_beside_designs(click.get_current_context())
    if plot is not None:
        _check_picture(plot)
        check_writable(plot, overwrite=force)
    measured = _measured(costs) or shipped_costs(preset)
    if gil is not None:
        measured = [replace(one, gil=gil) for one in measured]
    base = Setting(
        actors=1,
        latency=latency / 1e3,
        bandwidth=bandwidth * 1e6,
        learner_bandwidth=None if learner_bandwidth is None else learner_bandwidth * 1e6,
        **setting,
    )
    if designs:
        compared = designs_of(measured, base)
    else:
        adapted = costs_of(measured, learn_from).adapted(compress=compress, parameters_form=parameters)
        compared = [Design(described(adapted, measured), adapted, base)]
    rows: list[Row] = []
    with Progress("Simulating", len(compared) * len(numbers), None) as progress:
        for design in compared:
            for number in numbers:
                note, done, began = f"{design.name}, {number:,} actors", len(rows), time.perf_counter()
                predicted = simulate(
                    design.costs,
                    replace(design.setting, actors=number),
                    seed,
                    partial(_tell, progress, done, note),
                )
                rows.append(Row(design, predicted, time.perf_counter() - began))
        progress.update(len(rows))
    if plot is not None:
        write_atomically(plot, picture(rows, measured[0]), overwrite=force)
    if as_json:
        echo_json(to_json(rows, command_line(click.get_current_context()), seed))
    else:
        print_table(rows)


def _tell(progress: "Progress", done: int, note: str, share: float) -> None:
    progress.update(done + share, note)


def _check_picture(path: Path) -> None:
    """Refuse to write a picture into a file that does not look like one.

    Raises:
        InvalidValueError: It does not end in .png.
    """
    if path.suffix.lower() != ".png":
        message = f"Pictures are written as PNG; name a file that ends in .png, not '{path}'."
        raise InvalidValueError(message)


def _measured(paths: tuple[Path, ...]) -> "list[Costs]":
    """Read files of costs.

    Raises:
        DamagedFileError: One is none.
        InvalidValueError: Two are of the same.
    """
    from hoz_dist.scaling.costs import Costs

    read = [Costs.from_text(path.read_text(encoding="utf-8", errors="replace"), str(path)) for path in paths]
    if len({one.learn_from for one in read}) < len(read):
        message = "Give one file of --costs of gradients, and one of rollouts; two are of the same."
        raise InvalidValueError(message)
    return read


def _refuse_beside_designs(context: click.Context) -> None:
    """Refuse options in whose place `--designs` is.

    Raises:
        InvalidValueError: One was given.
    """
    for option in context.command.params:
        given = context.get_parameter_source(option.name or "") is ParameterSource.COMMANDLINE
        if option.name in _NOT_WITH_DESIGNS and given:
            message = f"--designs has its own {option.opts[0]}: leave out one of the two."
            raise InvalidValueError(message)


def _numbers(texts: tuple[str, ...]) -> list[int]:
    """Read numbers of actors.

    Raises:
        InvalidValueError: One is none.
    """
    words = [word for text in texts for word in text.split(",")]
    wrong = next((word for word in words if not (word.isascii() and word.isdigit())), None)
    if wrong is None:
        wrong = next((word for word in words if not 1 <= int(word) <= MOST_ACTORS), None)
    if wrong is not None:
        message = f"'{wrong}' is no number of actors; give whole numbers from 1 to {MOST_ACTORS:,}, as 1,10,100."
        raise InvalidValueError(message)
    return [int(word) for word in words]
