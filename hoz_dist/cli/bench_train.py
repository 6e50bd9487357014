"""`hoz-dist bench train`: frames per second of whole runs, and which stage they wait for."""

import os
import signal
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import click

from hoz_dist.bench.timings import TimingsFile, Totals, totals_of
from hoz_dist.bench.training import Trainers
from hoz_dist.cli.bench_options import benchmark_options, command_line, first_rooms, rooms_option, show_metrics
from hoz_dist.cli.child import die_with_parent
from hoz_dist.cli.options import cache_option, force_option, scenes_option
from hoz_dist.cli.ports import free_endpoint
from hoz_dist.cli.processes import Child, Children
from hoz_dist.cli.run_options import as_arguments, run_config, run_options
from hoz_dist.errors import HozError, InvalidValueError
from hoz_dist.nav.categories import scenes_to_tell

if TYPE_CHECKING:
    from hoz_dist.cli.apart import Companion
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
@scenes_option
@rooms_option(1)
@click.option(
    "--costs",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write what an update costs, for `hoz-dist simulate`, and compare the other runs with its predictions; needs "
    "--actors 1 and --actors 2.",
)
@force_option
@cache_option
@partial(benchmark_options, seconds=4.0)
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
    actors of the others stand still.
    """
    if costs is not None and not {1, 2} <= set(actors):
        message = "--costs needs runs with 1 and 2 actors: add --actors 1 --actors 2."
        raise InvalidValueError(message)

    from hoz_dist.atomic import check_writable, write_atomically
    from hoz_dist.bench.training import bottleneck, measure_in_turns, metrics_of, prediction_metrics, turns_metric
    from hoz_dist.cli.launch import sharing
    from hoz_dist.cli.progress import Progress
    from hoz_dist.cli.rendering import Encoding, render_rooms
    from hoz_dist.sim.view_store import default_cache

    if costs is not None:
        check_writable(costs, overwrite=force)
    rooms = first_rooms(scenes, most_rooms)
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
        most = max(counts[0], 2) if costs is not None else counts[0]
        loops = stack.enter_context(_in_process(config, rooms, folder, weights, logs, most))
        with Progress("Getting ready", 1.0, None) as progress:
            for number, (name, trainers) in enumerate({"in process": loops, **runs}.items()):
                trainers.resume()
                for ready in trainers.await_rooms():
                    progress.update((number + ready / len(trainers.files)) / (len(runs) + 1), name)
                trainers.pause()
            progress.update(1.0)
        with Progress("Measuring", 1.0, None) as progress:
            core = _core_to_share() if costs is not None else None
            turns = {f"{count} on a core": loops.first(count, core) for count in (1, 2) if core is not None}
            measured = measure_in_turns(
                {**runs, "in process": loops.first(counts[0]), **turns},
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

        command = command_line(click.get_current_context())
        ratio = turns_metric(*(measured[name] for name in turns)) if turns else None
        if ratio is None:
            click.echo(
                "What taking turns on a core costs was not measured: this system binds no process to one.", err=True
            )
        else:
            metrics["switching_ratio"] = ratio
        found = measured_costs(config, measured[_name(1)], measured[_name(2)], ratio, jobs, command)
        write_atomically(costs, found.to_text().encode(), overwrite=force)
        for count in counts:
            metrics |= prediction_metrics(measured[_name(count)], _predicted(found, count, jobs), f"_a{count}")
    show_metrics(metrics, as_json=as_json, more={"bottleneck": bottleneck(measured[first])})


def _name(actors: int) -> str:
    return f"{actors} actors" if actors > 1 else "1 actor"


def _predicted(costs: "Costs", actors: int, cores: int) -> float:
    from hoz_dist.scaling.model import simulate
    from hoz_dist.scaling.setting import Setting

    return simulate(costs, Setting(actors=actors, one_host=True, cores=cores)).frames_per_second


class _Run(Trainers):
    """A learner and its actors, which start when they are first told to train. Use it in a ``with`` statement.

    Actors are not stopped before they have made updates: one that was stopped as it started would not yet die with this
    process. The learner is never stopped: it has nothing to do while its actors stand still, but for a checkpoint of
    what they did before.

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
        self._endpoint = free_endpoint()
        self._paths = [folder / f"actor-{number}.jsonl" for number in range(actors)]
        self._actors: list[Child] = []
        self.files = [TimingsFile(path) for path in self._paths]

    def __enter__(self) -> Self:
        from hoz_dist.cli.launch import start_learner

        with ExitStack() as stack:
            self._folder.mkdir()
            self._children = stack.enter_context(Children(orphaned=signal.SIGKILL))
            run, log = self._folder / "bench", self._folder / "learner.log"
            learner = start_learner(self._children, self._endpoint, run, self._learner_words, log)
            self._client = stack.enter_context(_client(self._endpoint, learner))
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        for actor in self._actors:
            actor.terminate()  # all at once, before each is waited for
        self._stack.close()

    def resume(self) -> None:
        from hoz_dist.cli.launch import start_actor

        for actor in self._actors:
            actor.resume()
        for path in self._paths[len(self._actors) :]:
            words = [*self._actor_words, "--timings", str(path)]
            log = path.with_suffix(".log")
            self._actors.append(start_actor(self._children, self._endpoint, path.stem, words, log))

    def pause(self) -> None:
        for actor in self._actors:
            actor.pause()

    def check(self) -> None:
        for child in self._children:
            if child.status is not None:
                message = f"The {child.name} ended: {child.last_words()}"
                raise HozError(message)

    def learner(self) -> Totals:
        return totals_of(self._client.status()["timings"])


class _Loops(Trainers):
    """Processes that train without Zenoh.

    Args:
        files: What each of them writes.
        loops: The processes.
        core: The core that all of them share while they train; None for any of those that this process may use.
    """

    def __init__(self, files: Sequence[TimingsFile], loops: "Sequence[Companion]", core: int | None = None) -> None:
        self.files = files
        self._loops = loops
        self._core = core

    def first(self, count: int, core: int | None = None) -> "_Loops":
        """Return the first ones of them, which may share a core."""
        return _Loops(self.files[:count], self._loops[:count], core)

    def resume(self) -> None:
        for loop in self._loops:
            if self._core is not None:
                loop.run_on({self._core})
            loop.resume()

    def pause(self) -> None:
        for loop in self._loops:
            loop.pause()
            if self._core is not None:
                loop.run_on(os.sched_getaffinity(0))

    def check(self) -> None:
        for loop in self._loops:
            loop.check()


@contextmanager
def _in_process(
    config: "RunConfig", rooms: "Sequence[RoomId]", cache: Path, weights: Path | None, folder: Path, count: int
) -> Iterator[_Loops]:
    """Start processes that train without Zenoh, and stand still until they are told to train."""
    from hoz_dist.bench.loop import train_in_process
    from hoz_dist.cli.apart import companion

    paths = [folder / f"alone-{number}.jsonl" for number in range(count)]
    with ExitStack() as stack:
        work = partial(train_in_process, config, rooms, cache, weights)
        works = (partial(work, path.stem, path) for path in paths)
        companions = [stack.enter_context(companion(partial(_mortal, os.getpid(), work))) for work in works]
        loops = _Loops([TimingsFile(path) for path in paths], companions)
        loops.pause()
        yield loops


def _core_to_share() -> int | None:
    """Return a core to which processes can be bound; None where the system binds none."""
    cores = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, cores)
    except OSError:
        return None
    return max(cores)


def _mortal(parent: int, work: Callable[..., None], **told: Any) -> None:
    """Do the work of a process that may stand still, and then hears nothing but SIGKILL."""
    die_with_parent(parent, signal.SIGKILL)
    work(**told)


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
