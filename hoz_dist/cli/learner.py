"""`hoz-dist learner`: a learner process that actors, robots and queries connect to."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from hoz_dist.cli.options import picture_size_option
from hoz_dist.config import PRESET_LEARNING_RATES, RunConfig


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
@click.option(
    "--model", "method", default=RunConfig.method, show_default=True, help="What guides the agent: a3c, object or hoz."
)
@click.option(
    "--without",
    multiple=True,
    help="Layer of the model to switch off: object, scene, zone or done (the done reminder); may be repeated.",
)
@click.option("--preset", default=RunConfig.preset, show_default=True, help="Sizes of the network: compact or paper.")
@click.option("--encoder", default=RunConfig.encoder, show_default=True, help="Visual encoder: pooled or resnet18.")
@click.option(
    "--weights",
    type=click.Path(path_type=Path),
    help="Weights of the resnet18 encoder, .safetensors or .pth.  [default: none needed]",
)
@picture_size_option
@click.option("--zones", type=int, metavar="K", default=RunConfig.zones, show_default=True, help="Zones of a graph.")
@click.option(
    "--edge-cost",
    default=RunConfig.edge_cost,
    show_default=True,
    help="What makes a path over zones short: product or normalized.",
)
@click.option(
    "--seed", type=int, default=RunConfig.seed, show_default=True, help="Seed of the parameters and the episodes."
)
@click.option("--minutes", type=float, help="Budget of training time, minutes.  [default: none, until stopped]")
@click.option("--frames", type=int, help="Budget of environment frames.  [default: none, until stopped]")
@click.option(
    "--learning-rate",
    type=float,
    help="Adam's step size at the start; falls linearly to 0 over the budget.  [default: 0.001 compact, 0.0001 paper]",
)
@click.option(
    "--max-lag",
    type=int,
    default=RunConfig.max_lag,
    show_default=True,
    help="Largest policy lag of a gradient that is applied, parameter versions.",
)
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
    weights: Path | None,
    learning_rate: float | None,
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
    config = _config(weights, learning_rate, choices)

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


def _config(weights: Path | None, learning_rate: float | None, choices: dict[str, Any]) -> RunConfig:
    """Return the run's configuration.

    Args:
        weights: Of the encoder.
        learning_rate: None for the preset's.
        choices: The fields of the configuration that are options of the same name.
    """
    from hoz_dist.policy.encoders import load_encoder

    config = RunConfig(**choices)  # checks the names before they are used below
    encoder = load_encoder(config.encoder, weights)
    return replace(
        config,
        learning_rate=PRESET_LEARNING_RATES[config.preset] if learning_rate is None else learning_rate,
        encoder_key=encoder.key,
        channels=encoder.channels,
    )
