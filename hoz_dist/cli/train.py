"""`hoz-dist train`: a learner and its actors on this machine, then the results."""

import socket
from pathlib import Path
from typing import Any

import click

from hoz_dist.cli.options import cache_option, picture_size_option
from hoz_dist.nav.categories import SCENES


@click.command("train")
@click.option(
    "--run",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("runs/train"),
    show_default=True,
    help="Folder of the run; one that exists is resumed.",
)
@click.option(
    "--minutes",
    type=click.FloatRange(0.01),
    help="Training time, minutes, rendering of the rooms included.  [default: 10, without --frames]",
)
@click.option("--frames", type=click.IntRange(1), help="Train for this many frames instead of a time.")
@click.option("--actors", type=click.IntRange(1, 256), default=2, show_default=True, help="Number of actor processes.")
@click.option(
    "--model",
    default="hoz",
    show_default=True,
    help="Method: a3c, object (a3c and the object layer) or hoz (object and scene, zones, done reminder).",
)
@click.option(
    "--without",
    multiple=True,
    help="Layer of the model to switch off: object, scene, zone or done (the done reminder); may be repeated.",
)
@click.option("--preset", default="compact", show_default=True, help="Sizes of the network: compact or paper.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of parameters and episodes.")
@click.option(
    "--scene",
    "scenes",
    multiple=True,
    help=f"Scene or room to train in: {', '.join(SCENES)}, kitchen/3; may be repeated.  [default: all scenes]",
)
@click.option(
    "--episodes",
    type=click.IntRange(0, 100_000),
    default=400,
    show_default=True,
    help="Validation episodes in each scene afterwards; 0 for no evaluation.",
)
@click.option("--encoder", default="pooled", show_default=True, help="Visual encoder: pooled or resnet18.")
@click.option(
    "--weights",
    type=click.Path(path_type=Path),
    help="Weights of the resnet18 encoder, .safetensors or .pth.  [default: none needed]",
)
@picture_size_option
@cache_option
def train_command(
    run: Path,
    minutes: float | None,
    frames: int | None,
    actors: int,
    model: str,
    without: tuple[str, ...],
    preset: str,
    seed: int,
    scenes: tuple[str, ...],
    episodes: int,
    encoder: str,
    weights: Path | None,
    picture_size: int,
    cache: Path | None,
) -> None:
    """Train on this machine, then measure the agent on unseen validation rooms and draw pictures.

    Starts one learner and some actors, which find each other over Zenoh on a loopback port. Ctrl-C stops them cleanly;
    the same command then goes on where the run was.
    """
    from hoz_dist.cli.launch import launch
    from hoz_dist.config import RunConfig
    from hoz_dist.nav.rooms import training_rooms

    training_rooms(scenes or SCENES)  # what is wrong with them is said before anything starts
    minutes = 10.0 if minutes is None and frames is None else minutes
    choices: dict[str, Any] = {"method": model, "preset": preset, "encoder": encoder, "seed": seed}
    RunConfig(**choices, minutes=minutes, frames=frames)  # says what is wrong before any process starts
    files = [] if weights is None else ["--weights", str(weights)]
    learner = ["--model", model, "--preset", preset, "--encoder", encoder, "--seed", str(seed), *files]
    learner += ["--picture-size", str(picture_size)]
    learner += [word for layer in without for word in ("--without", layer)]
    learner += ["--minutes", str(minutes)] if frames is None else ["--frames", str(frames)]
    actor = [word for place in scenes or SCENES for word in ("--scene", place)] + files
    actor += [] if cache is None else ["--cache", str(cache)]

    launch(run, f"tcp/127.0.0.1:{_free_port()}", learner, actor, actors)

    from hoz_dist.cli.report import report  # only now: it takes seconds to import

    report(run, episodes=episodes, seed=seed, weights=weights, cache=cache)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port
