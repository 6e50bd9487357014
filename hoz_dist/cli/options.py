"""Options that several commands share, and how results are printed."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from hoz_dist.nav.categories import ROOM_SCENES, SCENES
from hoz_dist.nav.pose import PICTURE_SIZE

F = TypeVar("F", bound=Callable[..., Any])

scenes_option = click.option(
    "--scene",
    "scenes",
    multiple=True,
    default=ROOM_SCENES,
    show_default=", ".join(ROOM_SCENES),
    help=f"Scene ({', '.join(SCENES)}) or training room (kitchen/3) to train in; may be repeated.",
)

cache_option = click.option(
    "--cache",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder that keeps rendered views; else HOZ_CACHE, else the user's cache folder.",
)

picture_size_option = click.option(
    "--picture-size",
    type=click.IntRange(16, 512),
    default=PICTURE_SIZE,
    show_default=True,
    help="Side of the camera's square pictures, pixels.",
)

weights_option = click.option(
    "--weights",
    type=click.Path(path_type=Path),
    help="Weights of the resnet18 encoder, .safetensors or .pth.  [default: none needed]",
)

keep_every_option = click.option(
    "--keep-every",
    type=click.IntRange(min=1),
    metavar="FRAMES",
    help="Keep a checkpoint every so many frames for ever, for curves.  [default: the last of the run]",
)

json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON for scripts.")

force_option = click.option("--force", is_flag=True, help="Replace the output file if it exists. Default: refuse.")


def trial_options(trials: int) -> Callable[[F], F]:
    """Return what gives a command the options of trials in rooms: split, trials, seed, episodes and scenes.

    Args:
        trials: Default of ``--trials``.
    """
    options = (
        click.option(
            "--split", type=click.Choice(["val", "test"]), default="val", show_default=True, help="Rooms to use."
        ),
        click.option(
            "--trials",
            type=click.IntRange(1, 100),
            default=trials,
            show_default=True,
            help="Trials; each draws its own actions.",
        ),
        click.option(
            "--seed",
            type=click.IntRange(0),
            default=0,
            show_default=True,
            help="Seed of the first trial; the next adds 1.",
        ),
        click.option(
            "--episodes",
            type=click.IntRange(1, 100_000),
            default=400,
            show_default=True,
            help="Episodes in each scene.",
        ),
        click.option(
            "--scene",
            "scenes",
            multiple=True,
            help=f"Scene to evaluate in: {', '.join(SCENES)}; may be repeated.  [default: those it was trained in]",
        ),
    )

    def decorate(command: F) -> F:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def echo_json(value: Any) -> None:
    """Print a value as JSON on standard output."""
    click.echo(json.dumps(value, indent=2))
