"""A leader and standbys, real processes at a real router, through every way in which a leader can be lost."""

import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from hoz_dist.cli.main import run as hoz_dist_main
from hoz_dist.client import HozClient
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.rejection import Reason
from learner.checkpoint import load_checkpoint
from learner.leadership import claim
from learner.replay import read_updates
from learner.standby import STILL_S
from tests.integration.commands import HozDist
from tests.integration.learning import (
    CONFIG,
    FakeActor,
    LearnerProcess,
    gradient_for,
    graph_of,
    status_when,
    wait_for_checkpoint,
)
from tests.waiting import until

pytestmark = pytest.mark.integration

TAKE_OVER_S = 5.0


class Cluster:
    """A router and learners that meet there."""

    def __init__(self, port: int, folder: Path) -> None:
        self.endpoint = f"tcp/127.0.0.1:{port}"
        self.run = folder / "run"
        self._folder = folder
        self._processes: list[HozDist] = []
        self.router = self.start_router()

    def start_router(self) -> HozDist:
        router = self._start("router", "router", "--listen", self.endpoint)
        until(lambda: "Listening" in router.said or not router.runs, "the router")
        return router

    def restart_router(self, away_s: float) -> None:
        """Kill the router and start it again after some time."""
        self.router.stop(signal.SIGKILL)
        back_at = time.monotonic() + away_s
        until(lambda: time.monotonic() >= back_at, "the end of the outage")
        self.router = self.start_router()

    def learner(self, name: str, *options: str) -> HozDist:
        """Start a learner at the router; its checkpoints are a second apart."""
        words = ["--connect", self.endpoint, "--run", str(self.run), "--name", name, "--zones", str(CONFIG.zones)]
        return self._start(name, "learner", *words, "--checkpoint-seconds", "1", *options)

    def pair(self, *options: str) -> tuple[HozDist, HozDist]:
        """Start a leader, Anna, and then a standby, Ben, that both may take turns."""
        anna = self.learner("anna", "--standby", *options)
        self.wait_for_leader(1, "anna")
        ben = self.learner("ben", "--standby", *options)
        until(lambda: "ben: follows run" in self.log, "the standby")
        return anna, ben

    @property
    def log(self) -> str:
        path = self.run / "learner.log"
        return path.read_text() if path.exists() else ""

    @property
    def leaders(self) -> list[tuple[str, int, int]]:
        """Name, epoch and first version of all who led, from the log."""
        lines = re.findall(r" (\S+): leads run run, epoch (\d+), from version (\d+) ", self.log)
        return [(name, int(epoch), int(version)) for name, epoch, version in lines]

    def wait_for_leader(self, epoch: int, name: str | None = None) -> float:
        """Wait until an epoch is led; return how long it took."""
        start = time.monotonic()
        until(lambda: any(leader[1] == epoch for leader in self.leaders), f"epoch {epoch}")
        if name is not None:
            assert self.leaders[-1][0] == name
        return time.monotonic() - start

    @property
    def epochs(self) -> list[str]:
        return sorted(path.name for path in (self.run / "epochs").iterdir())

    def close(self) -> None:
        for process in reversed(self._processes):
            process.__exit__(None, None, None)

    def _start(self, name: str, *words: str) -> HozDist:
        process = HozDist(*words, log=self._folder / f"{name}.out")
        self._processes.append(process)
        return process


@pytest.fixture
def cluster(free_port: int, tmp_path: Path) -> Iterator[Cluster]:
    cluster = Cluster(free_port, tmp_path)
    yield cluster
    cluster.close()


def roles(status: dict[str, object]) -> list[tuple[str, str]]:
    """Return role and name of the learners that hold a live token."""
    processes = status["processes"]
    assert isinstance(processes, list)
    return sorted((process["role"], process["id"]) for process in processes if process["role"] != "actor")


def train(actor: FakeActor, epoch: int, version: int, updates: int) -> None:
    """Let an actor's gradients be applied, from a version on; its sequence numbers are the versions."""
    for number in range(version, version + updates):
        parameters = actor.fetch((epoch, number))
        answer = actor.gradient(number, parameters.head.stamp, gradient_for(parameters, number))
        assert isinstance(answer, Accepted)
        assert (answer.epoch, answer.version) == (epoch, number + 1)


def test_a_standby_takes_over_from_a_killed_leader(cluster: Cluster) -> None:
    anna, _ = cluster.pair()
    with FakeActor(cluster.endpoint, "run") as actor, HozClient(cluster.endpoint) as client:
        assert isinstance(actor.room_graph(0, graph_of("kitchen/1")), Accepted)
        train(actor, 1, 0, 3)
        status = status_when(client, lambda status: len(status["processes"]) == 3)
        assert roles(status) == [("learner", "anna"), ("standby", "ben")]
        assert status["leader"]["name"] == "anna"
        wait_for_checkpoint(cluster.run, version=3)
        stale = gradient_for(actor.fetch(), 9)
        anna.stop(signal.SIGKILL)
        assert cluster.wait_for_leader(2, "ben") < TAKE_OVER_S
        assert cluster.leaders[-1] == ("ben", 2, 3)
        # What counted in a checkpoint counts once; another gradient of the old epoch is refused by name.
        assert isinstance(actor.gradient(2, (1, 2), stale), Accepted)
        refused = actor.gradient(3, (1, 3), stale)
        assert isinstance(refused, Refused)
        assert refused.reason == Reason.EPOCH
        newest = actor.fetch((2, 3))
        answer = actor.gradient(4, newest.head.stamp, gradient_for(newest, 4))
        assert isinstance(answer, Accepted)
        assert (answer.epoch, answer.version) == (2, 4)
        status = status_when(client, lambda status: status["version"] == 4)
        assert (status["epoch"], status["frames"], status["leader"]["name"]) == (2, 80, "ben")
        assert client.graph("kitchen").rooms == ("kitchen/1",)


def test_a_leader_that_stood_still_finds_itself_deposed_and_follows(cluster: Cluster) -> None:
    anna, ben = cluster.pair()
    with FakeActor(cluster.endpoint, "run") as actor, HozClient(cluster.endpoint) as client:
        train(actor, 1, 0, 2)
        wait_for_checkpoint(cluster.run, version=2)
        train(actor, 1, 2, 1)  # so that the leader has something to save when it wakes up
        anna.process.send_signal(signal.SIGSTOP)
        assert cluster.wait_for_leader(2, "ben") < TAKE_OVER_S
        assert cluster.leaders[-1][2] in (2, 3)
        start = cluster.leaders[-1][2]
        train(actor, 2, start, 3)
        wait_for_checkpoint(cluster.run, version=start + 3)
        before = {path.name for path in (cluster.run / "checkpoints").iterdir()}
        anna.process.send_signal(signal.SIGCONT)
        until(lambda: "anna: deposed" in cluster.log, "the end of the old leader")
        status = status_when(client, lambda status: roles(status) == [("learner", "ben"), ("standby", "anna")])
        assert (status["epoch"], status["version"]) == (2, start + 3)
        assert {path.name for path in (cluster.run / "checkpoints").iterdir()} == before
        assert load_checkpoint(cluster.run).version == start + 3
        # And it takes its turn again.
        ben.stop(signal.SIGKILL)
        assert cluster.wait_for_leader(3, "anna") < TAKE_OVER_S
        assert cluster.leaders[-1] == ("anna", 3, start + 3)
        train(actor, 3, start + 3, 1)
    assert anna.stop(signal.SIGTERM) == 0
    assert [leader[1] for leader in cluster.leaders] == [1, 2, 3]
    assert load_checkpoint(cluster.run).version == len(read_updates(cluster.run)) == start + 4
    assert "Traceback" not in cluster.log + anna.said


def test_a_leader_that_is_stopped_hands_over_all_it_has(cluster: Cluster) -> None:
    anna, _ = cluster.pair("--checkpoint-seconds", "1000")
    with FakeActor(cluster.endpoint, "run") as actor:
        train(actor, 1, 0, 2)
        anna.process.send_signal(signal.SIGTERM)
        assert cluster.wait_for_leader(2, "ben") < TAKE_OVER_S
        assert cluster.leaders[-1] == ("ben", 2, 2)
        assert anna.wait() == 0
        train(actor, 2, 2, 1)


def test_the_restart_of_the_router_deposes_nobody(cluster: Cluster) -> None:
    cluster.pair()
    with FakeActor(cluster.endpoint, "run") as actor, HozClient(cluster.endpoint) as client:
        train(actor, 1, 0, 1)
        for version, away_s in ((1, 0.0), (2, 2 * STILL_S)):
            cluster.restart_router(away_s)
            train(actor, 1, version, 1)
            status_when(client, lambda status: roles(status) == [("learner", "anna"), ("standby", "ben")])
    assert cluster.epochs == ["0001"]


def test_of_two_that_start_together_one_leads(cluster: Cluster) -> None:
    for name in ("anna", "ben"):
        cluster.learner(name, "--standby")
    cluster.wait_for_leader(1)
    with HozClient(cluster.endpoint) as client:
        status_when(client, lambda status: [role for role, _ in roles(status)] == ["learner", "standby"])
    assert cluster.epochs == ["0001"]
    assert len(cluster.leaders) == 1


def test_a_second_learner_that_is_no_standby_is_refused(cluster: Cluster) -> None:
    cluster.learner("anna")
    cluster.wait_for_leader(1, "anna")
    second = cluster.learner("ben")
    assert second.wait() == 2
    assert "Another learner is using the run folder" in second.said
    assert len(second.said.strip().splitlines()) == 1
    assert cluster.epochs == ["0001"]


def test_a_run_that_is_over_ends_leader_and_standby(cluster: Cluster) -> None:
    anna, ben = cluster.pair("--frames", "40", "--exit-when-done")
    with FakeActor(cluster.endpoint, "run") as actor:
        train(actor, 1, 0, 2)
    assert anna.wait() == 0
    assert ben.wait() == 0
    assert cluster.leaders == [("anna", 1, 0), ("ben", 2, 2)]
    assert load_checkpoint(cluster.run).version == 2


def test_a_standby_waits_for_its_router(free_port: int, tmp_path: Path) -> None:
    endpoint, run = f"tcp/127.0.0.1:{free_port}", tmp_path / "run"
    words = ["learner", "--connect", endpoint, "--standby", "--run", str(run), "--zones", "3"]
    with HozDist(*words, log=tmp_path / "learner.out") as learner:
        until(lambda: "Waiting for it." in learner.said, "the learner")
        with HozDist("router", "--listen", endpoint, log=tmp_path / "router.out"):
            until(lambda: "leads run" in learner.said, "the leader")
            assert learner.stop(signal.SIGTERM) == 0
        assert learner.said.count("Waiting for it.") == 1


def test_a_deposed_learner_that_is_its_own_router_ends_and_says_why(free_port: int, tmp_path: Path) -> None:
    run = tmp_path / "run"
    with (
        LearnerProcess(free_port, run, "--checkpoint-seconds", "1000").ready() as learner,
        FakeActor(learner.endpoint, "run") as actor,
    ):
        train(actor, 1, 0, 1)
        leadership = claim(run, 1)
        assert leadership is not None
        with leadership:
            assert learner.process.wait(10) == 2
        assert learner.process.stderr is not None
        last = learner.process.stderr.read().strip().splitlines()[-1]
    assert last.startswith("hoz-dist: Another learner leads the run")
    assert list((run / "checkpoints").glob("*")) == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--standby"], "--standby needs --connect"),
        (["--connect", "tcp/127.0.0.1:1", "--listen", "tcp/127.0.0.1:2"], "exclude each other"),
        (["--name", "a/b"], "name 'a/b' cannot be used"),
        (["--connect", "nowhere", "--standby"], "is not an endpoint"),
    ],
)
def test_options_that_do_not_fit_are_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    assert hoz_dist_main(["learner", "--run", str(tmp_path / "run"), *words]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "run").exists()
