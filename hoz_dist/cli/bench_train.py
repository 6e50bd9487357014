"""`hoz-dist bench train`: frames per second of whole runs, and which stage they wait for."""

import multiprocessing
import os
import signal
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import click

from hoz_dist.bench.timings import TimingsFile, Totals, totals_of
from hoz_dist.bench.training import Trainers
from hoz_dist.cli.bench_options import command_line, repeats_option, show_metrics
from hoz_dist.cli.options import cache_option, force_option, json_option
from hoz_dist.cli.ports import free_endpoint
from hoz_dist.cli.processes import Child, Children
from hoz_dist.cli.run_options import as_arguments, run_config, run_options
from hoz_dist.errors import HozError, InvalidValueError
from hoz_dist.nav.categories import ROOM_SCENES, scenes_to_tell

if TYPE_CHECKING:
    from hoz_dist.client import HozClient
    from hoz_dist.config import RunConfig
    from hoz_dist.nav.rooms import RoomId
    from hoz_dist.scaling.costs import Costs


@click.command("train")
@click.option(
    "--actors",
    type=click.IntRange(1, 64),
    multiple=True,
    default=(2,),
    show_default=True,
    metavar="N",
    help="Number of actor processes; may be repeated for several runs, of which the first is compared with as many "
    "processes without Zenoh.",
)
@run_options
@click.option(
    "--scene",
    "scenes",
    multiple=True,
    default=ROOM_SCENES,
    show_default=", ".join(ROOM_SCENES),
    help="Scene or training room to train in, kitchen or kitchen/3; may be repeated.",
)
@click.option(
    "--rooms",
    "most_rooms",
    type=click.IntRange(1, 20),
    default=1,
    show_default=True,
    help="Training rooms of each scene; more take longer to come into use.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(0.1, 600.0),
    default=4.0,
    show_default=True,
    help="Length of one measurement, seconds; of several updates of an actor.",
)
@repeats_option
@click.option(
    "--costs",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write what an update costs, for `hoz-dist simulate`, and compare the other runs with its predictions; needs "
    "--actors 1 and --actors 2.",
)
@force_option
@cache_option
@json_option
def train_command(
    actors: tuple[int, ...],
    scenes: tuple[str, ...],
    most_rooms: int,
    seconds: float,
    repeats: int,
    costs: Path | None,
    cache: Path | None,
    *,
    force: bool,
    as_json: bool,
    **choices: Any,
) -> None:
    """Measure frames per second of training on this machine, and name the stage that it waits for.

    A learner and its actors as `hoz-dist train` starts them, once all rooms are in use. The limit: as many processes
    that each act, differentiate and optimise without Zenoh. All that is compared takes turns; while one is measured the
    others stand still.
    """
    if costs is not None and not {1, 2} <= set(actors):
        message = "--costs needs runs with 1 and 2 actors: add --actors 1 --actors 2."
        raise InvalidValueError(message)

    from hoz_dist.atomic import check_writable, write_atomically
    from hoz_dist.bench.training import bottleneck, measure_in_turns, metrics_of
    from hoz_dist.cli.launch import sharing
    from hoz_dist.cli.progress import Progress
    from hoz_dist.cli.rendering import Encoding, render_rooms
    from hoz_dist.nav.rooms import training_rooms
    from hoz_dist.sim.view_store import default_cache

    if costs is not None:
        check_writable(costs, overwrite=force)
    rooms = [room for scene in scenes for room in training_rooms((scene,))[:most_rooms]]
    choices["scenes"] = scenes_to_tell(room.scene for room in rooms)
    config = run_config(choices | {"minutes": None, "frames": None})
    folder = cache or default_cache()
    jobs, counts = len(os.sched_getaffinity(0)), tuple(dict.fromkeys(actors))
    render_rooms(rooms, folder, config.picture_size, jobs, Encoding(config.encoder, choices["weights"]))
    with ExitStack() as stack:
        logs = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="hoz-dist-")))
        shared, weights = sharing(config.preset), choices["weights"]
        learner = as_arguments(choices | {"cache": folder}) + shared
        actor = as_arguments({"scene": tuple(map(str, rooms)), "weights": weights, "cache": folder}) + shared
        runs: dict[str, Trainers] = {
            _name(count): stack.enter_context(_Run(logs / _name(count), count, learner, actor)) for count in counts
        }
        loops = partial(_in_process, config, rooms, folder, weights, logs)
        alone = {"in process": stack.enter_context(loops(counts[0]))}
        with Progress("Getting ready", 1.0, None) as progress:
            for number, (name, trainers) in enumerate((runs | alone).items()):
                trainers.resume()
                for ready in trainers.await_rooms():
                    progress.update((number + ready / len(trainers.files)) / (len(runs) + 1), name)
                trainers.pause()
            progress.update(1.0)
        with Progress("Measuring", 1.0, None) as progress:
            measured = measure_in_turns(
                runs | alone,
                seconds=seconds,
                repeats=repeats,
                progress=lambda done, total, note: progress.update(done, note, total=total),
            )
    first = _name(counts[0])
    metrics = metrics_of(measured[first], measured["in process"])
    for count in counts[1:]:
        metrics |= metrics_of(measured[_name(count)], None, f"_a{count}")
    if costs is not None:
        from hoz_dist.bench.costs import measured_costs
        from hoz_dist.bench.report import Metric

        command = command_line(click.get_current_context())
        found = measured_costs(config, measured[_name(1)], measured[_name(2)], jobs, command)
        write_atomically(costs, found.to_text().encode(), overwrite=force)
        for count in counts:
            real = measured[_name(count)].median(lambda window: window.frames_per_second)
            predicted = Metric.of([_predicted(found, count, jobs)], "frames/s", real)
            metrics[f"predicted_frames_per_second_a{count}"] = predicted
    show_metrics(metrics, as_json=as_json, more={"bottleneck": bottleneck(measured[first])})


def _name(actors: int) -> str:
    return f"{actors} actors" if actors > 1 else "1 actor"


def _predicted(costs: "Costs", actors: int, cores: int) -> float:
    from hoz_dist.scaling.model import simulate
    from hoz_dist.scaling.setting import Setting

    return simulate(costs, Setting(actors=actors, one_host=True, cores=cores)).frames_per_second


class _Run(Trainers):
    """A learner and its actors, which stand still until they are told to train. Use it in a ``with`` statement.

    Args:
        folder: Where the run and its logs are put.
        actors: Number of actors.
        learner: Further options of the learner.
        actor: Further options of every actor.
    """

    def __init__(self, folder: Path, actors: int, learner: Sequence[str], actor: Sequence[str]) -> None:
        self._folder = folder
        self._stack = ExitStack()
        self._learner_words = learner
        self._actor_words = actor
        paths = [folder / f"actor-{number}.jsonl" for number in range(actors)]
        self._paths = paths
        self.files = [TimingsFile(path) for path in paths]

    def __enter__(self) -> Self:
        from hoz_dist.cli.launch import start_actor, start_learner

        with ExitStack() as stack:
            self._folder.mkdir()
            self._children = stack.enter_context(Children(orphaned=signal.SIGKILL))
            endpoint, run = free_endpoint(), self._folder / "bench"
            learner = start_learner(self._children, endpoint, run, self._learner_words, self._folder / "learner.log")
            self._client = stack.enter_context(_client(endpoint, learner))
            self._actors = [
                start_actor(
                    self._children,
                    endpoint,
                    path.stem,
                    [*self._actor_words, "--timings", str(path)],
                    path.with_suffix(".log"),
                )
                for path in self._paths
            ]
            self.pause()
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        for actor in self._actors:
            actor.terminate()  # all at once, before each is waited for
        self._stack.close()

    def resume(self) -> None:
        for actor in self._actors:
            actor.resume()

    def pause(self) -> None:
        for actor in self._actors:
            actor.pause()

    def check(self) -> None:
        for child in self._children:
            if child.status is not None:
                message = f"The {child.name} ended: {child.last_words()}"
                raise HozError(message)

    def learner(self) -> Totals:
        status = self._client.status()
        return totals_of(status["timings"]) | {"busy": float(status["busy"]), "version": float(status["version"])}


class _Loops(Trainers):
    """Processes that train without Zenoh."""

    def __init__(self, paths: Sequence[Path], gate: Any) -> None:
        self.files = [TimingsFile(path) for path in paths]
        self._gate = gate

    def resume(self) -> None:
        self._gate.set()

    def pause(self) -> None:
        self._gate.clear()

    def check(self) -> None:
        """Nothing to look at: a process that failed says so when it is told to stop."""


@contextmanager
def _in_process(
    config: "RunConfig", rooms: "Sequence[RoomId]", cache: Path, weights: Path | None, folder: Path, count: int
) -> Iterator[_Loops]:
    """Start processes that train without Zenoh, and stand still until they are told to train."""
    from hoz_dist.bench.loop import train_in_process
    from hoz_dist.cli.apart import companion

    gate = multiprocessing.get_context("spawn").Event()
    paths = [folder / f"alone-{number}.jsonl" for number in range(count)]
    with ExitStack() as stack:
        for path in paths:
            work = partial(train_in_process, config, rooms, cache, weights, path.stem, path, gate)
            stack.enter_context(companion(work))
        yield _Loops(paths, gate)


@contextmanager
def _client(endpoint: str, learner: Child) -> "Iterator[HozClient]":
    """Open a client once the learner serves."""
    from hoz_dist.cli.launch import connect

    client = connect(endpoint, learner)
    if client is None:
        message = "The learner of a new run ended at once."
        raise HozError(message)
    with client:
        yield client
