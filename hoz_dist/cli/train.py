"""`hoz-dist train`: a learner and its actors on this machine, then the results."""

from pathlib import Path
from typing import Any

import click

from hoz_dist.cli.options import cache_option, keep_every_option, scenes_option
from hoz_dist.cli.ports import free_endpoint
from hoz_dist.cli.run_options import as_arguments, run_config, run_options
from hoz_dist.nav.categories import scenes_to_tell


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
@run_options
@scenes_option
@click.option(
    "--episodes",
    type=click.IntRange(0, 100_000),
    default=400,
    show_default=True,
    help="Validation episodes in each scene afterwards; 0 for no evaluation.",
)
@click.option(
    "--shared-memory/--no-shared-memory",
    default=None,
    help="Hand over large messages through shared memory.  [default: with --preset paper]",
)
@keep_every_option
@cache_option
def train_command(
    run: Path,
    minutes: float | None,
    frames: int | None,
    actors: int,
    scenes: tuple[str, ...],
    episodes: int,
    keep_every: int | None,
    cache: Path | None,
    *,
    shared_memory: bool | None,
    **choices: Any,
) -> None:
    """Train on this machine, then measure the agent on unseen validation rooms and draw pictures.

    Starts one learner and some actors, which find each other over Zenoh on a loopback port. Ctrl-C stops them cleanly;
    the same command then goes on where the run was.
    """
    from hoz_dist.cli.launch import launch, sharing
    from hoz_dist.nav.rooms import training_rooms

    # What is wrong with the options is said before anything starts.
    choices["scenes"] = scenes_to_tell(room.scene for room in training_rooms(scenes))
    choices |= {"minutes": 10.0 if minutes is None and frames is None else minutes, "frames": frames}
    config = run_config(choices)
    files = {"weights": choices["weights"], "cache": cache}
    shared = sharing(config.preset, wanted=shared_memory)
    actor = as_arguments({"scene": scenes, **files}) + shared
    learner = as_arguments(choices | {"keep_every": keep_every, "cache": cache}) + shared

    launch(run, free_endpoint(), learner, actor, actors)

    from hoz_dist.cli.report import report  # only now: it takes seconds to import

    report(run, episodes=episodes, seed=choices["seed"], weights=choices["weights"], cache=cache)
