"""`hoz-dist simulate`: what a run would do with more actors, hosts and links than there are."""

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from hoz_dist.cli.options import echo_json, json_option
from hoz_dist.errors import InvalidValueError

if TYPE_CHECKING:
    from hoz_dist.scaling.setting import Prediction

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
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
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
    "--relays",
    type=int,
    default=0,
    show_default=True,
    metavar="R",
    help="Relays that hand on parameters and sum up gradients, each on a host. A design: there are none today.",
)
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
    seed: int,
    *,
    as_json: bool,
    **setting: Any,
) -> None:
    """Predict the speed, policy lag and load of a run with any number of actors.

    A discrete-event simulation fed by measured costs; docs/scaling.md says how near it comes. 10,000 actors take about
    a minute.
    """
    from hoz_dist.cli.progress import Progress
    from hoz_dist.scaling.costs import load_costs, shipped_costs
    from hoz_dist.scaling.model import simulate
    from hoz_dist.scaling.setting import Setting

    measured = shipped_costs(preset) if costs is None else load_costs(costs)
    measured = measured.adapted(learn_from=learn_from, compress=compress, parameters_form=parameters)
    base = Setting(
        actors=1,
        latency=latency / 1e3,
        bandwidth=bandwidth * 1e6,
        learner_bandwidth=None if learner_bandwidth is None else learner_bandwidth * 1e6,
        **(setting | {"relays": 0}),
    )
    settings = [replace(base, actors=number, relays=setting["relays"]) for number in _numbers(actors)]
    predictions, took = [], []
    with Progress("Simulating", len(settings), None) as progress:
        for done, one in enumerate(settings):
            began = time.perf_counter()
            note = f"{one.actors:,} actors"
            predictions.append(
                simulate(measured, one, seed, lambda share, d=done, n=note: progress.update(d + share, n))
            )
            took.append(time.perf_counter() - began)
        progress.update(len(settings))
    if as_json:
        results = [one.to_json() | {"took_seconds": round(s, 1)} for one, s in zip(predictions, took, strict=True)]
        echo_json({"costs": {"preset": measured.preset, "machine": measured.machine}, "predictions": results})
        return
    _print(predictions)


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


def _print(predictions: "list[Prediction]") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table()
    for column in ("actors", "frames/s", "lag", "age", "stale", "busy", "learner", "to it", "from it", "fullest"):
        table.add_column(column, justify="left" if column == "fullest" else "right")
    for one in predictions:
        table.add_row(
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


_FILE_WIDTH: Final = 140
_LEGEND: Final = (
    "lag: parameter versions; age: from an actor's parameters to the update; stale: gradients refused for their lag; "
    "busy: times that a gradient is told to come again; learner: load of the thread that applies gradients."
)
