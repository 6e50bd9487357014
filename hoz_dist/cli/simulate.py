"""`hoz-dist simulate`: what a run would do with more actors, hosts and links than there are."""

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from hoz_dist.cli.options import echo_json, force_option, json_option
from hoz_dist.errors import InvalidValueError

if TYPE_CHECKING:
    from hoz_dist.cli.progress import Progress
    from hoz_dist.scaling.costs import Costs

DEFAULT_ACTORS: Final = ("1,10,100,1000,10000",)


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
    metavar="FILE",
    help="Costs that `hoz-dist bench train --costs FILE` measured.  [default: those shipped for the preset]",
)
@click.option(
    "--one-host",
    is_flag=True,
    help="All processes on one host, without a network. Default: the learner has a host, each actor a core of its own.",
)
@click.option(
    "--cores", type=int, default=8, show_default=True, help="Cores of the learner's host; of the one with --one-host."
)
@click.option(
    "--latency", type=float, default=0.1, show_default=True, metavar="MS", help="Of a message, one way, milliseconds."
)
@click.option(
    "--bandwidth", type=float, default=10_000.0, show_default=True, metavar="MBIT", help="Of a host's link, Mbit/s."
)
@click.option(
    "--learner-bandwidth",
    type=float,
    metavar="MBIT",
    help="Of the links of learners and relays, Mbit/s.  [default: as --bandwidth]",
)
@click.option("--learn-from", help="gradients or rollouts.  [default: what the costs were measured with]")
@click.option("--compress", help="fp32, bf16, int8 or topk.  [default: what the costs were measured with]")
@click.option("--parameters", help="full or delta.  [default: what the costs were measured with]")
@click.option(
    "--max-lag", type=int, default=32, show_default=True, help="Largest policy lag of a gradient that is applied."
)
@click.option(
    "--shards",
    type=int,
    default=1,
    show_default=True,
    metavar="S",
    help="Learners that share the parameters, each on a host. A design: there is one learner today.",
)
@click.option(
    "--fan-out",
    type=int,
    metavar="F",
    help="Put relays, which hand on parameters and sum up gradients, between the learner and more than F actors; each "
    "has a host and up to F below it. A design: there are none today.  [default: none]",
)
@click.option(
    "--designs",
    is_flag=True,
    help="Compare designs: full gradients, small ones, rollouts, several learners, relays; takes the place of "
    "--learn-from, --compress, --parameters, --shards and --fan-out.",
)
@click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Draw frames per second against the number of actors into a PNG file.",
)
@force_option
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of everything random in the simulation.")
@json_option
def simulate_command(
    actors: tuple[str, ...],
    preset: str,
    costs: Path | None,
    latency: float,
    bandwidth: float,
    learner_bandwidth: float | None,
    learn_from: str | None,
    compress: str | None,
    parameters: str | None,
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
    from hoz_dist.cli.progress import Progress
    from hoz_dist.cli.simulate_output import Row, picture, print_table
    from hoz_dist.scaling.costs import Costs, shipped_costs
    from hoz_dist.scaling.designs import Design
    from hoz_dist.scaling.designs import designs as designs_of
    from hoz_dist.scaling.model import simulate
    from hoz_dist.scaling.setting import Setting

    numbers = _numbers(actors)
    if plot is not None:
        check_writable(plot, overwrite=force)
    if costs is None:
        measured = shipped_costs(preset)
    else:
        measured = Costs.from_text(costs.read_text(encoding="utf-8", errors="replace"), str(costs))
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
        adapted = measured.adapted(learn_from=learn_from, compress=compress, parameters_form=parameters)
        compared = [Design(_described(adapted), adapted, base)]
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
                rows.append(Row(design.name, predicted, time.perf_counter() - began))
        progress.update(len(rows))
    if plot is not None:
        write_atomically(plot, picture(rows, measured), overwrite=force)
    if as_json:
        results = [
            {"design": row.design} | row.prediction.to_json() | {"took_seconds": round(row.took, 1)} for row in rows
        ]
        echo_json({"costs": {"preset": measured.preset, "machine": measured.machine}, "predictions": results})
    else:
        print_table(rows)


def _tell(progress: "Progress", done: int, note: str, share: float) -> None:
    progress.update(done + share, note)


def _described(costs: "Costs") -> str:
    what = "rollouts" if costs.learn_from == "rollouts" else f"{costs.compress} gradients"
    return f"{what}, {costs.parameters_form} parameters"


def _numbers(texts: tuple[str, ...]) -> list[int]:
    """Read numbers of actors.

    Raises:
        InvalidValueError: One is none.
    """
    words = [word for text in texts for word in text.split(",")]
    wrong = next((word for word in words if not (word.isascii() and word.isdigit())), None)
    if wrong is not None:
        message = f"'{wrong}' is no number of actors; give whole numbers, as in --actors 1,10,100."
        raise InvalidValueError(message)
    return [int(word) for word in words]
