"""Runs a real learner, and pretends to be its actors, over real Zenoh."""

import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from hoz_dist.client import HozClient
from hoz_dist.config import RunConfig
from hoz_dist.errors import HozError
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.membership.liveliness import Member, declare_alive
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.parameters import Parameters
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.transport.environment import child_environment
from hoz_dist.wire.transport.session import open_client
from learner.checkpoint import FOLDER, Stamp, checkpoint_files
from learner.service import LearnerSettings, catalogue_digests, serve

CONFIG = RunConfig(zones=3)
DEADLINE_S = 30.0

Answer = Accepted | Refused


class FakeActor:
    """Pushes what a test gives it. Use it in a ``with`` statement."""

    def __init__(self, endpoint: str, run: str, name: str = "a", incarnation: int = 1) -> None:
        self.name, self.incarnation = name, incarnation
        self._keys, self._stop = Keys(run), threading.Event()
        with ExitStack() as stack:
            session = stack.enter_context(open_client(endpoint, timeout_s=DEADLINE_S))
            stack.enter_context(declare_alive(session, self._keys, Member("actor", name, "host", incarnation)))
            self._follower = stack.enter_context(ParametersFollower(session, self._keys, self._stop))
            self._pusher = Pusher(session, self._stop, attempt_s=2.0)
            self._open = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        self._open.close()

    def fetch(self, at_least: tuple[int, int] | None = None) -> Parameters:
        return self._follower.fetch(at_least, DEADLINE_S)

    def gradient(self, sequence: int, computed_on: tuple[int, int], values: NDArray[np.float32]) -> Answer:
        epoch, version = computed_on
        push = GradientPush(self.name, self.incarnation, sequence, epoch, version, 20, values)
        return self._pusher.push(self._keys.grads(self.name), push, DEADLINE_S)

    def episodes(self, sequence: int, *outcomes: tuple[str, bool]) -> Answer:
        results = tuple(EpisodeResult(RoomId.parse(room), 0, success, 9, 4, True, 5) for room, success in outcomes)
        push = EpisodesPush(self.name, self.incarnation, sequence, episodes=results)
        return self._pusher.push(self._keys.rollouts(self.name), push, DEADLINE_S)

    def room_graph(self, sequence: int, graph: RoomGraph) -> Answer:
        room = RoomId.parse(graph.room)
        push = RoomGraphPush(
            self.name, self.incarnation, sequence, room, graph.digest, TARGETS, graph.nodes, graph.edges
        )
        return self._pusher.push(self._keys.room(self.name, room), push, DEADLINE_S)


def gradient_for(parameters: Parameters, seed: int) -> NDArray[np.float32]:
    """A gradient that depends on what it was computed on, as a real one does, and is no longer than one may be."""
    noise = np.random.default_rng(seed).normal(size=parameters.vector.size)
    values = 0.1 * parameters.vector + 0.01 * noise
    return (values * (CONFIG.gradient_norm / np.linalg.norm(values))).astype(np.float32)


def graph_of(room: str, seed: int = 0, zones: int = CONFIG.zones) -> RoomGraph:
    generator = np.random.default_rng(seed)
    edges = generator.uniform(0.05, 0.95, size=(zones, zones))
    edges = (edges + edges.T) / 2
    np.fill_diagonal(edges, 1.0)
    return RoomGraph(room, catalogue_digests()[room], generator.uniform(size=(zones, len(TARGETS))), edges)


@contextmanager
def running_learner(
    port: int, run: Path, config: RunConfig = CONFIG, *, replay: Path | None = None, exit_when_done: bool = False
) -> Iterator[str]:
    """Serve in a thread of this process; yields the endpoint, and stops the learner cleanly at the end."""
    endpoint = f"tcp/127.0.0.1:{port}"
    settings = LearnerSettings(listen=endpoint, run=run, config=config, replay=replay, exit_when_done=exit_when_done)
    stop = threading.Event()
    failed: list[BaseException] = []

    def work() -> None:
        try:
            serve(settings, stop)
        except BaseException as error:  # noqa: BLE001 - handed to the test's thread below
            failed.append(error)

    thread = threading.Thread(target=work, name="test-learner")
    thread.start()
    try:
        wait_until_answering(endpoint, thread.is_alive)
        yield endpoint
    finally:
        if not exit_when_done:
            stop.set()
        thread.join(DEADLINE_S)
        assert not thread.is_alive()
        if failed:
            raise failed[0]


class LearnerProcess:
    """A real `hoz-dist learner`. Use it in a ``with`` statement; it is killed at the end if it still runs."""

    def __init__(self, port: int, run: Path, *options: str) -> None:
        self.endpoint = f"tcp/127.0.0.1:{port}"
        self.process = subprocess.Popen(
            [
                *(sys.executable, "-m", "hoz_dist.cli.main", "learner", "--listen", self.endpoint),
                *("--run", str(run), "--zones", str(CONFIG.zones), *options),
            ],
            env=child_environment(),
            stderr=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None:
            self.kill()
        if self.process.stderr is not None:
            self.process.stderr.close()

    def ready(self) -> Self:
        wait_until_answering(self.endpoint, lambda: self.process.poll() is None)
        return self

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(DEADLINE_S)

    def stop(self, number: signal.Signals) -> int:
        self.process.send_signal(number)
        return self.process.wait(DEADLINE_S)


def wait_until_answering(endpoint: str, alive: Callable[[], bool]) -> None:
    """Wait until a learner answers at the endpoint."""
    pause = threading.Event()
    for _ in range(200):
        if not alive():
            return
        try:
            with HozClient(endpoint) as client:
                client.config()
        except HozError:
            pause.wait(0.1)
        else:
            return
    message = f"no learner answers at {endpoint}"
    raise TimeoutError(message)


def wait_for_checkpoint(run: Path, version: int) -> None:
    """Wait until a checkpoint of that version, or a later one, is there."""
    pause = threading.Event()
    for _ in range(int(DEADLINE_S / 0.05)):
        stamps = [Stamp.of(path) for path in checkpoint_files(run / FOLDER)]
        if any(stamp.version >= version for stamp in stamps if stamp is not None):
            return
        pause.wait(0.05)
    message = f"no checkpoint of version {version}"
    raise TimeoutError(message)


def status_when(client: HozClient, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Ask for the status until it is as wanted.

    A push that went with its learner is waited for 10 s, and 20 s if the next try is lost as well; this waits longer.
    """
    pause = threading.Event()
    for _ in range(600):
        status = client.status()
        if wanted(status):
            return status
        pause.wait(0.1)
    message = f"the status stayed {status}"
    raise TimeoutError(message)
