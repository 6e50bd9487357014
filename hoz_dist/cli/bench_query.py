"""`hoz-dist bench query`: how soon a learner answers, idle or while it trains."""

import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from hoz_dist.cli.bench_options import benchmark_options, show_metrics
from hoz_dist.cli.options import cache_option
from hoz_dist.cli.ports import free_endpoint
from hoz_dist.errors import HozError, InvalidValueError
from hoz_dist.nav.rooms import RoomId

if TYPE_CHECKING:
    from hoz_dist.cli.processes import Children
    from hoz_dist.client import HozClient

START_S: Final = 300.0
"""How long a training may take to come into full swing, the rendering of its room included, seconds."""
FULL_SWING: Final = 50
"""Updates after which a training is in full swing."""
ACTORS: Final = 2
"""Actors of a training, unless another number is asked for."""
_ROOM: Final = "kitchen/1"
"""The only room of a training: more would only make it start later."""


@click.command("query")
@click.option(
    "--training",
    is_flag=True,
    help="Ask a learner that trains; with --connect, one that does.  [default: one that is idle]",
)
@click.option(
    "--actors", type=click.IntRange(1, 64), show_default=str(ACTORS), help="Actors of the training, processes."
)
@click.option(
    "--connect", metavar="ENDPOINT", help="Ask the learner that runs there.  [default: one started for the benchmark]"
)
@click.option(
    "--clients", type=click.IntRange(1, 256), default=4, show_default=True, help="Clients that ask at once, threads."
)
@cache_option
@benchmark_options
def query_command(
    actors: int | None,
    connect: str | None,
    clients: int,
    cache: Path | None,
    seconds: float,
    repeats: int,
    *,
    training: bool,
    as_json: bool,
) -> None:
    """Measure how soon a scene graph comes when asked for, and how many of them in a second.

    The limit: as many bytes by Zenoh alone, from a process that does nothing else, asked in turns with the learner. The
    training is of the compact size, with all its processes on this machine.
    """
    starts_training = training and connect is None
    if not starts_training and (actors, cache) != (None, None):
        message = "--actors and --cache are of a training that is started here: add --training, without --connect."
        raise InvalidValueError(message)

    from hoz_dist.bench.bare import answer_bare
    from hoz_dist.bench.query import bench_query, graph_bytes, scene_with_graph
    from hoz_dist.cli.apart import companion, work_apart

    with _learner(connect, (actors or ACTORS) if starts_training else 0, cache) as endpoint:
        # What a learner tells of its scenes is half a second old; that of ours is known.
        scene = RoomId.parse(_ROOM).scene if connect is None else scene_with_graph(endpoint)
        bare = free_endpoint()
        with companion(partial(answer_bare, bare, graph_bytes(scene, endpoint))):
            work = partial(
                bench_query,
                endpoint,
                bare,
                scene,
                "training" if training else "idle",
                clients=clients,
                seconds=seconds,
                repeats=repeats,
            )
            metrics = work_apart("Measuring", work)
    show_metrics(metrics, as_json=as_json)


@contextmanager
def _learner(connect: str | None, actors: int, cache: Path | None) -> Iterator[str]:
    """Give the endpoint of a learner that has a scene graph, and trains if it has actors."""
    if connect is not None:
        yield connect
        return

    from hoz_dist.bench.query import give_graph
    from hoz_dist.cli import launch
    from hoz_dist.cli.processes import Children
    from hoz_dist.cli.run_options import as_arguments

    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory(prefix="hoz-dist-") as logs, Children() as children:
        folder = Path(logs)
        client = launch.connect(
            endpoint, launch.start_learner(children, endpoint, folder / "bench", (), folder / "learner")
        )
        assert client is not None  # noqa: S101 - a run without a budget does not end
        with client:
            if not actors:
                give_graph(endpoint, RoomId.parse(_ROOM))
            options = as_arguments({"scene": _ROOM, "cache": cache})
            for number in range(actors):
                name = f"actor-{number}"
                launch.start_actor(children, endpoint, name, options, folder / name)
            if actors:
                _await_full_swing(client, children)
            yield endpoint


def _await_full_swing(client: "HozClient", children: "Children") -> None:
    """Wait until the training has come some way.

    Raises:
        HozError: A process failed, or the training does not come so far in time.
    """
    from hoz_dist.cli.progress import Progress
    from hoz_dist.waiting import Backoff, Deadline

    deadline, backoff = Deadline(START_S), Backoff(threading.Event())
    with Progress("Waiting for the training", FULL_SWING, "updates") as progress:
        while (version := client.status()["version"]) < FULL_SWING:
            for child in children:
                child.keep_running()
            if deadline.passed:
                message = f"The training did not come to {FULL_SWING} updates within {START_S:g} s."
                raise HozError(message)
            progress.update(version)
            backoff.pause(deadline)
        progress.update(FULL_SWING)
