"""Runs a learner and its actors as child processes, and shows how the training goes."""

import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Final

import click

from hoz_dist.cli.processes import Child, Children
from hoz_dist.cli.progress import Progress
from hoz_dist.client import HozClient
from hoz_dist.errors import ConnectionFailedError, HozError
from hoz_dist.policy.settings import Preset
from hoz_dist.waiting import Deadline

START_S: Final = 60.0
"""How long the learner may take to answer for the first time, seconds."""
POLL_S: Final = 1.0


def sharing(preset: Preset, *, wanted: bool | None = None) -> list[str]:
    """Return the further options of a learner and actors that share a machine.

    They hand over messages of tens of megabytes through shared memory, which is faster. Those of a small network gain
    little, and Zenoh keeps the memory of killed actors; see docs/decisions/shared-memory.md.

    Args:
        preset: Size of the network.
        wanted: What the user says; None for nothing.
    """
    share = preset == "paper" if wanted is None else wanted
    return ["--shared-memory"] if share else []


Tell = Callable[[dict[str, Any]], None]
"""Is told the status of a run now and then, as `HozClient.status` returns it."""


def launch(
    run: Path, endpoint: str, learner: Sequence[str], actor: Sequence[str], actors: int, tell: Tell | None = None
) -> None:
    """Train until the run's budget is used up.

    Args:
        run: Folder of the run.
        endpoint: Where the learner listens.
        learner: Further options of the learner.
        actor: Further options of every actor.
        actors: Number of actors.
        tell: Told how far the training is; None shows it.

    Raises:
        HozError: A process failed; its own words are in the sentence.
        KeyboardInterrupt: Stopped by SIGINT or SIGTERM, after the children have stopped cleanly.
    """
    with tempfile.TemporaryDirectory(prefix="hoz-dist-") as logs, Children() as children:
        options = ["--exit-when-done", *learner]
        core = start_learner(children, endpoint, run, options, Path(logs) / "learner")
        client = connect(endpoint, core)
        if client is None:
            click.echo(f"The run in {run} has used up its budget; another --run trains anew.")
            return
        with client:
            for number in range(actors):
                name = f"actor-{number}"
                start_actor(children, endpoint, name, actor, run / f"{name}.log")
            if tell is not None:
                _watch(client, core, children, tell)
            else:
                _show(client, core, children)


def start_learner(children: Children, endpoint: str, run: Path, options: Sequence[str], log: Path) -> Child:
    """Start a learner that listens at an endpoint."""
    return children.start("learner", ["learner", "--listen", endpoint, "--run", str(run), *options], log)


def start_actor(children: Children, endpoint: str, name: str, options: Sequence[str], log: Path) -> Child:
    """Start an actor of the learner at an endpoint."""
    return children.start(name, ["actor", "--connect", endpoint, "--name", name, *options], log)


def connect(endpoint: str, learner: Child) -> HozClient | None:
    """Wait until the learner serves the run; None when it ends at once, because the budget was used up before.

    That it answers at its endpoint is not enough: only then does it look whether it may use the run folder.
    """
    deadline = Deadline(START_S)
    while not deadline.passed:
        if learner.status == 0:
            return None
        if learner.status is not None:
            # It says what is wrong: a run of another configuration, a folder in use, ...
            raise HozError(learner.last_words())
        with suppress(HozError), ExitStack() as stack:
            client = stack.enter_context(HozClient(endpoint))
            if client.status()["progress"] != 1.0:
                stack.pop_all()
                return client
    message = f"The learner did not answer at {endpoint} within {START_S:g} s: {learner.last_words()}"
    raise ConnectionFailedError(message)


def _show(client: HozClient, learner: Child, children: Children) -> None:
    """Show the progress until the learner ends."""
    summary = ""
    with Progress("Training", 1.0, None) as progress:

        def tell(status: dict[str, Any]) -> None:
            nonlocal summary
            summary = _summary(status)
            # A run that goes on has begun before this process.
            progress.update(status["progress"] or 0.0, summary, left=status["seconds_left"])

        _watch(client, learner, children, tell)
        progress.update(1.0, summary)


def _watch(client: HozClient, learner: Child, children: Children, tell: Tell) -> None:
    """Keep the processes running, and tell the progress, until the learner ends."""
    pause = threading.Event()
    actors = [child for child in children if child is not learner]
    while (ended := learner.status) != 0:
        if ended is not None:
            learner.keep_running()
        try:
            status = client.status()
        except HozError:
            status = None  # the learner is ending, or starting again
        if status is not None:
            tell(status)
        # Actors that find no learner, or a finished run, end; that is no failure.
        for actor in actors if status is not None and not status["finished"] else ():
            actor.keep_running()
        pause.wait(POLL_S)


def _summary(status: dict[str, Any]) -> str:
    """Say on one line how the training goes."""
    rooms = sum(len(scene["rooms"]) for scene in status["scenes"].values())
    actors = sum(process["role"] == "actor" for process in status["processes"])
    success = status["success"]["overall"]
    found = "no episodes yet" if success is None else f"success {success:.0%}"
    return (
        f"{status['frames'] / 1e6:.2f}M frames  {status['frames_per_second']:,.0f} frames/s  {found}  "
        f"{rooms} rooms  {actors} actors"
    )
