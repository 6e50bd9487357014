"""`hoz-dist learner`: a learner process that actors, robots and queries connect to."""

from pathlib import Path
from typing import Any

import click

from hoz_dist.cli.run_options import run_config, run_options


@click.command("learner")
@click.option(
    "--listen",
    metavar="ENDPOINT",
    default="tcp/127.0.0.1:7447",
    show_default=True,
    help="Endpoint to listen at, protocol/host:port.",
)
@click.option(
    "--run",
    type=click.Path(path_type=Path),
    default=Path("runs/default"),
    show_default=True,
    help="Folder of the run; one of the same configuration is resumed. Its last part is the run's name.",
)
@run_options
@click.option("--minutes", type=float, help="Budget of training time, minutes.  [default: none, until stopped]")
@click.option("--frames", type=int, help="Budget of environment frames.  [default: none, until stopped]")
@click.option(
    "--checkpoint-seconds",
    type=click.FloatRange(min=1.0),
    default=30.0,
    show_default=True,
    help="Time between checkpoints, seconds; what a killed learner loses at most.",
)
@click.option(
    "--replay",
    type=click.Path(path_type=Path),
    help="An updates.jsonl: apply exactly these updates, in this order.  [default: as gradients arrive]",
)
@click.option(
    "--exit-when-done", is_flag=True, help="Exit when the budget is used up.  [default: go on serving graphs]"
)
@click.option("--quiet", is_flag=True, help="Print warnings only.  [default: a line every 5 s]")
def learner_command(
    listen: str,
    run: Path,
    checkpoint_seconds: float,
    replay: Path | None,
    *,
    exit_when_done: bool,
    quiet: bool,
    **choices: Any,
) -> None:
    """Apply the gradients of actors, merge their room graphs, and serve parameters, graphs and plans at ENDPOINT.

    Actors may come and go. SIGINT and SIGTERM stop the learner after a last checkpoint; the same command
    goes on from it.
    """
    import logging
    import signal
    import threading

    # Before the imports that take seconds: it says what is wrong with the options.
    config = run_config(choices)

    import torch

    from learner.service import LearnerSettings, serve

    torch.set_num_threads(1)  # Actors share the cores, and one thread adds up the same way every time.
    settings = LearnerSettings(
        listen=listen,
        run=run,
        config=config,
        checkpoint_seconds=checkpoint_seconds,
        replay=replay,
        exit_when_done=exit_when_done,
    )
    console = logging.StreamHandler()
    console.setLevel(logging.WARNING if quiet else logging.INFO)
    console.setFormatter(logging.Formatter("%(asctime)s %(message)s", datefmt="%H:%M:%S"))
    logging.basicConfig(level=logging.INFO, handlers=[console])
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    serve(settings, stop)
