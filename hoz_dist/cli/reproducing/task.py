"""What one process of `hoz-dist reproduce` does at a stretch: trains a run, chooses its checkpoint, tests it.

Whatever is finished is in a file, written atomically, and is not done again: a checkpoint every half minute, the choice
of the checkpoint, the outcome of each test. So a process may be killed at any moment.
"""

import hashlib
import json
import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from hoz_dist import __version__
from hoz_dist.atomic import replace_file
from hoz_dist.cli.launch import launch
from hoz_dist.cli.ports import free_endpoint
from hoz_dist.cli.run_options import as_arguments
from hoz_dist.errors import DamagedFileError, HozError, NotFoundError
from hoz_dist.nav.rooms import Split
from hoz_dist.reproduce.job import Job, Task, Training
from hoz_dist.waiting import Deadline

if TYPE_CHECKING:
    from hoz_dist.evaluation.agents import Agent
    from hoz_dist.evaluation.benchmark import Benchmark
    from learner.checkpoint import Checkpoint

Stage = Literal["training", "choosing", "testing"]
FREE_S: Final = 30.0
"""How long a learner of a killed command may take to end, seconds."""
_POLL_S: Final = 0.1
_LIBRARIES: Final = ("torch", "numpy", "pybullet")
"""Whose versions are kept beside what was computed with them."""


class Report(NamedTuple):
    """How far a task is."""

    stage: Stage
    share: float = 0.0
    """Of the stage, in [0, 1]."""
    note: str = ""
    """More about it."""


Tell = Callable[[Report], None]


@dataclass(frozen=True)
class Place:
    """Where tasks keep things."""

    out: Path
    """Folder of all runs and results."""
    cache: Path
    """The view cache; it has the rooms already."""


def perform(task: Task, place: Place, tell: Tell) -> None:
    """Do what is left of a task.

    Args:
        task: The task.
        place: Where things are kept.
        tell: Told how far it is.

    Raises:
        HozError: Something failed.
    """
    waiting = task.waiting(place.out)
    if not waiting:
        return
    if task.training is not None:
        _train(task.training, place, tell)
    from hoz_dist.policy.threads import use_one_thread

    use_one_thread()
    for job in waiting:
        _test(job, place, tell)


def frames_of(training: Training, out: Path) -> int:
    """Return how many frames a training has made, as its newest checkpoint says; 0 before the first."""
    from learner.checkpoint import load_checkpoint

    try:
        return load_checkpoint(training.folder(out)).frames
    except NotFoundError:
        return 0


def _train(training: Training, place: Place, tell: Tell) -> None:
    """Train, or go on with it, by the real service: a learner and one actor, which do the same again."""
    from learner.run_folder import RunFolder

    folder = training.folder(place.out)
    tell(Report("training"))
    try:
        if frames_of(training, place.out) >= training.frames:
            return
    except DamagedFileError as error:
        message = f"{error} Delete the folder '{folder}' to have it trained anew."
        raise DamagedFileError(message) from error
    folder.parent.mkdir(parents=True, exist_ok=True)
    config = folder.with_name(f"{folder.name}.config.json")
    _write_json(config, training.config.to_json())
    run, pause, deadline = RunFolder(folder, training.config), threading.Event(), Deadline(FREE_S)
    while run.is_held(run.newest_epoch()) and not deadline.passed:
        pause.wait(_POLL_S)
    learner = ["--config", str(config), "--keep-every", str(training.keep_every), "--quiet"]
    actor = as_arguments({"scene": training.scenes, "cache": place.cache})

    def report(status: dict[str, Any]) -> None:
        tell(Report("training", status["progress"] or 0.0, f"{status['frames_per_second']:,.0f} frames/s"))

    launch(folder, free_endpoint(), learner, actor, actors=1, tell=report)
    if frames_of(training, place.out) < training.frames:
        message = f"The run in '{folder}' ended before its budget was used up; see its logs, and start again."
        raise HozError(message)


def _choose(job: Job, training: Training, place: Place, tell: Tell) -> "tuple[Checkpoint, dict[str, Any]]":
    """Return the checkpoint that is best on validation rooms by SR, then SPL, then frames; and how it was chosen."""
    from hoz_dist.cli.measure import agent_of
    from hoz_dist.nav.metrics import metrics_of
    from learner.checkpoint import FOLDER, kept_checkpoints, load_checkpoint

    file, run = job.choice(place.out), training.folder(place.out)
    if file.exists():
        choice = _read_json(file)
        path = run / FOLDER / choice["checkpoint"]
        # Chosen anew when somebody deleted the run, and it was trained again: then this checkpoint is gone, or another
        # one, for names say no more than epoch and version. Files from before the digest was kept are taken at their
        # word: to choose anew is to evaluate all candidates again.
        with suppress(NotFoundError):
            checkpoint = load_checkpoint(path)
            if choice.get("sha256") in {None, _sha256(path)}:
                return checkpoint, choice
    protocol, began = job.protocol, time.monotonic()
    benchmark = _benchmark(
        place, training.config.picture_size, protocol.rooms("val"), "val", protocol.validation_episodes
    )
    candidates: list[dict[str, Any]] = []
    kept = kept_checkpoints(run, with_newest=True)[-protocol.candidates :]
    for number, path in enumerate(kept):
        tell(Report("choosing", number / len(kept)))
        checkpoint = load_checkpoint(path)
        metrics = metrics_of(benchmark.run(agent_of(checkpoint), [0]).trials[0])
        candidates.append(
            {"checkpoint": path.name, "frames": checkpoint.frames}
            | {name: round(100 * getattr(metrics, name), 2) for name in ("sr", "spl", "sae")}
        )
    best = max(candidates, key=lambda one: (one["sr"], one["spl"], one["frames"]))
    path = run / FOLDER / best["checkpoint"]
    choice = {
        "checkpoint": path.name,
        "sha256": _sha256(path),
        "candidates": candidates,
        "seconds": time.monotonic() - began,
    }
    _write_json(file, choice)
    return load_checkpoint(path), choice


def _test(job: Job, place: Place, tell: Tell) -> None:
    """Test an agent on the test rooms, once for all, and keep what came of every episode."""
    from hoz_dist.cli.measure import agent_of
    from hoz_dist.evaluation.agents import OracleAgent, RandomAgent
    from hoz_dist.reproduce.outcome import Outcome
    from learner.checkpoint import load_checkpoint

    facts: dict[str, Any] = {
        "agent": job.agent,
        "version": __version__,
        "libraries": {name: version(name) for name in _LIBRARIES},
        "cores": len(os.sched_getaffinity(0)),
    }
    protocol, config = job.protocol, job.test_config
    chosen = None
    if job.training is not None:
        checkpoint, choice = _choose(job, job.training, place, tell)
        newest = load_checkpoint(job.training.folder(place.out))
        chosen = replace(checkpoint, config=config)
        facts |= {
            "config": config.to_json(),
            "rooms_trained_in": list(job.training.scenes),
            "tested_with": dict(job.tested_with),
            "frames": checkpoint.frames,
            # A run that went on from a checkpoint after a kill is not the same again with the same seed.
            "epochs": newest.epoch,
            "training_seconds": round(newest.seconds, 1),
            "seconds_to_chosen": round(checkpoint.seconds, 1),
            "choice": choice,
        }
    benchmark = _benchmark(place, config.picture_size, protocol.rooms("test"), "test", protocol.test_episodes)
    agent: Agent
    if chosen is not None:
        agent = agent_of(chosen)
    else:
        agent = RandomAgent() if job.agent == "random" else OracleAgent(list(benchmark.rooms))
    began = time.monotonic()

    def progress(done: int, total: int) -> None:
        tell(Report("testing", done / total))

    evaluation = benchmark.run(agent, range(protocol.trials), progress=progress)
    facts["test_seconds"] = round(time.monotonic() - began, 1)
    Outcome.of(evaluation, facts).save(job.result(place.out))


@cache
def _benchmark(place: Place, picture_size: int, rooms: tuple[Any, ...], split: Split, episodes: int) -> "Benchmark":
    """Open rooms and draw their episodes; tests of one process share them."""
    from hoz_dist.evaluation.benchmark import Benchmark
    from hoz_dist.policy.encoders import load_encoder
    from hoz_dist.sim.view_store import ViewStore

    store, encoder = ViewStore(place.cache, picture_size), load_encoder("pooled")
    return Benchmark.of([store.open(room, encoder) for room in rooms], split, episodes)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _write_json(path: Path, value: object) -> None:
    text = json.dumps(value, indent=2) + "\n"
    replace_file(path, lambda temporary: temporary.write_text(text, "utf-8"))


def _read_json(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(path.read_text("utf-8"))
    except ValueError as error:
        message = f"'{path}' is damaged ({error}); delete it, and what it held is done again."
        raise DamagedFileError(message) from error
    if not isinstance(value, dict) or not value.keys() >= {"checkpoint", "seconds"}:
        message = (
            f"'{path}' does not say what was chosen, and how long that took; delete it, and what it held is done again."
        )
        raise DamagedFileError(message)
    return value
