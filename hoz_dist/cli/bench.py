"""`hoz-dist bench`: how fast each part is on this machine, beside the limit that the machine sets.

A further benchmark is a click command in a module of its own (`hoz_dist.cli.bench_query` is one): it has the options of
`hoz_dist.cli.bench_options`, measures with `hoz_dist.bench`, prints by `show_metrics`, and is added to the group at the
end of this file.
"""

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hoz_dist.cli.bench_options import Measure, benchmark_options, compress_option, preset_option, show_metrics
from hoz_dist.cli.bench_query import query_command
from hoz_dist.cli.bench_train import train_command
from hoz_dist.cli.options import cache_option, picture_size_option
from hoz_dist.nav.categories import ROOM_SCENES
from hoz_dist.nav.pose import PICTURE_SIZE
from hoz_dist.nav.rooms import RoomId, training_rooms

if TYPE_CHECKING:
    from hoz_dist.config import Compression
    from hoz_dist.policy.settings import Preset


@click.group("bench")
def bench_group() -> None:
    """Measure how fast each part is on this machine, beside the limit that the machine sets.

    Every figure is the median of several measurements, taken in turns with its limit; docs/performance.md says what
    each of them means.
    """


@bench_group.command("env")
@click.option(
    "--batch", type=click.IntRange(1, 4096), default=256, show_default=True, help="Episodes that step together."
)
@click.option(
    "--scene",
    "scenes",
    multiple=True,
    default=ROOM_SCENES,
    show_default=", ".join(ROOM_SCENES),
    help="Scene or training room to step in, kitchen or kitchen/3; may be repeated.",
)
@click.option(
    "--rooms", type=click.IntRange(1, 20), default=2, show_default=True, help="Training rooms of each scene to step in."
)
@picture_size_option
@cache_option
@benchmark_options
def env_command(
    batch: int,
    scenes: tuple[str, ...],
    rooms: int,
    picture_size: int,
    cache: Path | None,
    seconds: float,
    repeats: int,
    *,
    as_json: bool,
) -> None:
    """Measure steps per second of stored environments, and how long a room takes to open.

    Of one core. A step includes picture features, boxes, appearance and bags, copied out. Limits: a plain copy of as
    many bytes, and reading a room's files.
    """
    # The rooms are named before the imports that take time: these say what is wrong with the names.
    names = [room for scene in scenes for room in training_rooms((scene,))[:rooms]]

    from hoz_dist.bench.env import bench_env
    from hoz_dist.cli.rendering import Encoding, render_rooms
    from hoz_dist.sim.view_store import default_cache

    folder = cache or default_cache()
    render_rooms(names, folder, picture_size, len(os.sched_getaffinity(0)), Encoding())
    _measure(bench_env, names, folder, picture_size, batch=batch, seconds=seconds, repeats=repeats, as_json=as_json)


@bench_group.command("render")
@click.option(
    "--picture-size",
    "sizes",
    type=click.IntRange(16, 512),
    multiple=True,
    default=(PICTURE_SIZE, 128),
    show_default=True,
    help="Side of the camera's square pictures, pixels; may be repeated.",
)
@click.option("--room", default="kitchen/1", show_default=True, help="Room to draw.")
@benchmark_options
def render_command(sizes: tuple[int, ...], room: str, seconds: float, repeats: int, *, as_json: bool) -> None:
    """Measure how many views a second are drawn into arrays, beside bare calls of PyBullet's renderer.

    Of one core, without a GPU. The views lie all over the room; both sides draw the same ones.
    """
    name = RoomId.parse(room)

    from hoz_dist.bench.render import bench_render

    _measure(bench_render, name, tuple(dict.fromkeys(sizes)), seconds=seconds, repeats=repeats, as_json=as_json)


@bench_group.command("policy")
@preset_option
@click.option("--steps", type=click.IntRange(2, 1000), default=20, show_default=True, help="Steps of a rollout.")
@benchmark_options
def policy_command(presets: "tuple[Preset, ...]", steps: int, seconds: float, repeats: int, *, as_json: bool) -> None:
    """Measure how many frames a second the policy acts in, and learns from.

    Of one core, model hoz. Acting in 1 and 64 episodes; the gradient of a rollout of 16 and 64 episodes, with the
    forward pass and from what acting recorded of it. The limit: the matrix products alone.
    """
    from hoz_dist.bench.policy import bench_policy

    _measure(bench_policy, presets, steps=steps, seconds=seconds, repeats=repeats, as_json=as_json)


@bench_group.command("learner")
@preset_option
@compress_option
@benchmark_options
def learner_command(
    presets: "tuple[Preset, ...]", codecs: "tuple[Compression, ...]", seconds: float, repeats: int, *, as_json: bool
) -> None:
    """Measure how long the learner takes from a gradient's bytes to changed parameters.

    Of one core; checksum, decoding and all checks are included. The limit: fused Adam alone on as many parameters.
    """
    from hoz_dist.bench.learner import bench_learner

    _measure(bench_learner, presets, codecs, seconds=seconds, repeats=repeats, as_json=as_json)


@bench_group.command("wire")
@click.option(
    "--megabytes",
    type=click.FloatRange(0.001, 100.0),
    default=40.0,
    show_default=True,
    help="Size of a gradient and of the parameters, megabytes (10^6 bytes).",
)
@compress_option
@benchmark_options
def wire_command(
    megabytes: float, codecs: "tuple[Compression, ...]", seconds: float, repeats: int, *, as_json: bool
) -> None:
    """Measure pushes and fetches between two processes of this machine over Zenoh, and the bytes of gradients.

    With and without shared memory. The limit: one plain copy of as many bytes; of a small push, a question and answer
    of Zenoh's own.
    """
    from hoz_dist.bench.receiver import receive
    from hoz_dist.bench.wire import bench_wire
    from hoz_dist.cli.apart import companion
    from hoz_dist.cli.ports import free_endpoint

    parameters = round(megabytes * 1e6 / 4)
    plain, shared = free_endpoint(), free_endpoint()
    with (
        companion(partial(receive, plain, parameters, shared_memory=False)),
        companion(partial(receive, shared, parameters, shared_memory=True)),
    ):
        _measure(bench_wire, plain, shared, parameters, codecs, seconds=seconds, repeats=repeats, as_json=as_json)


def _measure(measure: Measure, *arguments: Any, as_json: bool, **keywords: Any) -> None:
    """Run a benchmark in a process of its own, and print what it found."""
    from hoz_dist.cli.apart import work_apart

    show_metrics(work_apart("Measuring", partial(measure, *arguments, **keywords)), as_json=as_json)


bench_group.add_command(query_command)
bench_group.add_command(train_command)
