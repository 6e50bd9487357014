"""What `hoz-dist train` leaves behind and shows at its end: results, pictures, and the commands to try next."""

import json
import shlex
from pathlib import Path
from typing import Final

import click
from rich.console import Console

from hoz_dist.atomic import replace_file, write_atomically
from hoz_dist.cli.measure import Measurement, measure
from hoz_dist.cli.progress import duration
from hoz_dist.evaluation.table import comparison_table
from hoz_dist.evaluation.trace import trace_episodes
from hoz_dist.nav.categories import ROOM_SCENES, SCENES, scenes_to_tell
from hoz_dist.nav.episode import Episode
from hoz_dist.viz.trajectory import draw_trajectories, trajectories_of
from hoz_dist.viz.zones import png, scene_graph_figure
from hoz_dist.wire.transport.endpoint import DEFAULT_ENDPOINT
from learner.checkpoint import Checkpoint, load_checkpoint

RESULTS_FILE: Final = "evaluation.json"
TRAJECTORIES_FILE: Final = "trajectories.png"


def report(run: Path, *, episodes: int, seed: int, weights: Path | None, cache: Path | None) -> None:
    """Measure the newest checkpoint of a run, draw its graphs and some trajectories, and say what to try next.

    Args:
        run: Folder of the run.
        episodes: Validation episodes in each scene; 0 for none.
        seed: Seed of the actions.
        weights: Weights of the resnet18 encoder.
        cache: Folder of the view store; the default one when None.
    """
    console = Console()
    checkpoint = load_checkpoint(run)
    click.echo(
        f"Trained {checkpoint.frames:,} frames in {checkpoint.episodes:,} episodes and {duration(checkpoint.seconds)}; "
        f"{checkpoint.version:,} updates."
    )
    pictures = _draw_graphs(checkpoint, run)
    if episodes > 0:
        measurement = measure(checkpoint, split="val", seeds=[seed], episodes=episodes, weights=weights, cache=cache)
        console.print(comparison_table(measurement.comparison))
        results = json.dumps(measurement.comparison.to_json(), indent=2)
        write_atomically(run / RESULTS_FILE, f"{results}\n".encode(), overwrite=True)
        pictures.append(_draw_trajectories(measurement, run / TRAJECTORIES_FILE, seed))
    click.echo("Pictures: " + ", ".join(map(str, pictures)))
    click.echo("Try next:")
    files = [] if weights is None else ["--weights", str(weights)]
    files += [] if cache is None else ["--cache", str(cache)]
    for command in _next_commands(run, next(iter(checkpoint.graph_versions), SCENES[0]), files):
        click.echo(f"  {command}")


def _draw_graphs(checkpoint: Checkpoint, run: Path) -> list[Path]:
    pictures = []
    for scene, graph in checkpoint.scene_graphs().items():
        path = run / f"zones-{scene}.png"
        write_atomically(path, png(scene_graph_figure(graph)), overwrite=True)
        pictures.append(path)
    return pictures


def _draw_trajectories(measurement: Measurement, path: Path, seed: int) -> Path:
    """Draw the agent's way in a few episodes of each scene: the longest and the median one by L*."""
    benchmark = measurement.benchmark
    chosen: list[Episode] = []
    for scene in benchmark.scenes:
        of_scene = [episode for episode in benchmark.episodes if episode.room.scene == scene]
        by_length = sorted(of_scene, key=lambda episode: episode.optimal)
        chosen += dict.fromkeys((by_length[-1], by_length[len(by_length) // 2]))
    traces = trace_episodes(measurement.agent, benchmark.rooms, chosen, seed)
    trajectories = trajectories_of(traces, benchmark.rooms, measurement.agent.name)
    replace_file(path, lambda temporary: draw_trajectories(trajectories, temporary))
    return path


def _next_commands(run: Path, scene: str, files: list[str]) -> list[str]:
    """Return commands to try, fit to be pasted into a shell.

    Args:
        run: Folder of the run.
        scene: A scene of the run.
        files: Options that name the cache and the weights, if they were given.
    """
    connect = ["--connect", DEFAULT_ENDPOINT]
    telling = [] if scene in ROOM_SCENES else ["--scenes", str(scenes_to_tell([scene]))]
    commands = [
        ["hoz-dist", "evaluate", str(run), "--split", "test", *files],
        ["tensorboard", "--logdir", str(run / "tensorboard")],
        ["hoz-dist", "learner", "--listen", DEFAULT_ENDPOINT, *telling],
        ["hoz-dist", "actor", "--scene", scene, *connect],
        ["hoz-dist", "query", scene, *connect],
    ]
    return list(map(shlex.join, commands))
