"""The learner's service over real Zenoh, killed and restarted as a real process."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.client import HozClient
from hoz_dist.errors import HozError
from hoz_dist.graph.planner import plan_for
from hoz_dist.graph.scene_graph import merge_rooms
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.wire.membership.liveliness import host_name
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.pushes import GradientPush
from hoz_dist.wire.protocol.rejection import Reason
from learner.checkpoint import load_checkpoint
from learner.core import LearnerCore
from learner.events import GradientReceived
from learner.recorder import UpdateLog
from learner.replay import read_updates
from tests.integration.learning import (
    CONFIG,
    FakeActor,
    LearnerProcess,
    gradient_for,
    graph_of,
    running_learner,
    status_when,
    wait_for_checkpoint,
)

pytestmark = pytest.mark.integration


def test_gradients_train_as_in_the_core_alone(free_port: int, tmp_path: Path) -> None:
    run = tmp_path / "first"
    core = LearnerCore(CONFIG, initial_parameters(CONFIG.policy, CONFIG.seed))
    with running_learner(free_port, run) as endpoint, FakeActor(endpoint, "first") as actor:
        parameters = actor.fetch()
        assert parameters.head.stamp == (1, 0)
        np.testing.assert_array_equal(parameters.vector, initial_parameters(CONFIG.policy, CONFIG.seed))
        for sequence in range(5):
            values = gradient_for(parameters, sequence)
            answer = actor.gradient(sequence, parameters.head.stamp, values)
            assert isinstance(answer, Accepted)
            parameters = actor.fetch((answer.epoch, answer.version))
            core.handle(GradientReceived(0, GradientPush("a", 1, sequence, 1, sequence, 20, values)), now=0.0)
        assert parameters.vector.tobytes() == core.parameters.tobytes()
    saved = load_checkpoint(run)
    assert (saved.version, saved.frames) == (5, 100)
    assert saved.parameters.tobytes() == core.parameters.tobytes()
    assert len(read_updates(run)) == 5
    assert list((run / "tensorboard").glob("events.*"))


def test_rooms_become_scene_graphs_that_anybody_can_ask_for(free_port: int, tmp_path: Path) -> None:
    rooms = [graph_of("kitchen/2", 2), graph_of("kitchen/1", 1)]
    with (
        running_learner(free_port, tmp_path / "run") as endpoint,
        FakeActor(endpoint, "run") as actor,
        HozClient(endpoint) as client,
    ):
        for sequence, room in enumerate(rooms):
            assert isinstance(actor.room_graph(sequence, room), Accepted)
        graph = client.graph("kitchen")
        expected = merge_rooms("kitchen", rooms, version=2)
        assert (graph.rooms, graph.version) == (expected.rooms, 2)
        np.testing.assert_array_equal(graph.nodes, expected.nodes)
        np.testing.assert_array_equal(client.room_graph("kitchen/2").edges, rooms[0].edges)
        plan = client.plan("kitchen", target="Microwave", seen=["Sink", "Toaster"])
        assert plan == plan_for(expected, "Microwave", ["Sink", "Toaster"], CONFIG.edge_cost)
    # The graphs are there again after a restart, before any actor comes back.
    with running_learner(free_port, tmp_path / "run") as endpoint, HozClient(endpoint) as client:
        np.testing.assert_array_equal(client.graph("kitchen").nodes, expected.nodes)


def test_the_status_tells_who_is_alive_and_what_was_refused(free_port: int, tmp_path: Path) -> None:
    with running_learner(free_port, tmp_path / "run") as endpoint, HozClient(endpoint) as client:
        with FakeActor(endpoint, "run", "anna") as anna, FakeActor(endpoint, "run", "ben"):
            anna.gradient(0, (1, 0), gradient_for(anna.fetch(), 0))
            anna.episodes(0, ("kitchen/1", True), ("kitchen/2", False))
            short = anna.gradient(1, (1, 1), np.ones(5, dtype=np.float32))
            foreign = anna.room_graph(0, replace(graph_of("kitchen/1"), digest="another"))
            held = anna.room_graph(1, replace(graph_of("kitchen/25")))
            assert [answer.reason for answer in (short, foreign, held) if isinstance(answer, Refused)] == [
                Reason.SHAPE,
                Reason.DIGEST,
                Reason.SPLIT,
            ]
            status = status_when(client, lambda status: len(status["processes"]) == 3 and status["episodes"] == 2)
        left = status_when(client, lambda status: len(status["processes"]) == 1)
    assert [(process["role"], process["id"]) for process in status["processes"]] == [
        ("actor", "anna"),
        ("actor", "ben"),
        ("learner", host_name()),
    ]
    anna_status = status["processes"][0]
    assert (anna_status["frames"], anna_status["rejected"]) == (20, 3)
    assert anna_status["rooms"] == ["kitchen/1", "kitchen/2"]
    assert status["rejected"] == {"shape": 1, "digest": 1, "split": 1}
    assert (status["version"], status["epoch"], status["frames"], status["run"]) == (1, 1, 20, "run")
    assert status["success"] == {"episodes": 2, "overall": 0.5, "scenes": {"kitchen": 0.5}}
    assert [process["role"] for process in left["processes"]] == ["learner"]
    json.dumps(status)


def test_the_run_ends_with_its_budget_and_says_so(free_port: int, tmp_path: Path) -> None:
    config = replace(CONFIG, frames=40)
    with running_learner(free_port, tmp_path / "run", config) as endpoint, FakeActor(endpoint, "run") as actor:
        for sequence in range(2):
            assert isinstance(actor.gradient(sequence, (1, sequence), gradient_for(actor.fetch(), sequence)), Accepted)
        over = actor.gradient(2, (1, 2), gradient_for(actor.fetch(), 2))
        assert isinstance(over, Refused)
        assert over.reason == Reason.FINISHED
        with HozClient(endpoint) as client:
            status = status_when(client, lambda status: status["finished"])
            assert (status["progress"], status["rejected"]) == (1.0, {})
    assert (tmp_path / "run" / "checkpoints" / "0001-000000002.keep").exists()


def test_a_learner_that_exits_when_done_first_tells_its_actors(free_port: int, tmp_path: Path) -> None:
    config = replace(CONFIG, frames=20)
    with (
        running_learner(free_port, tmp_path / "run", config, exit_when_done=True) as endpoint,
        FakeActor(endpoint, "run") as actor,
    ):
        values = gradient_for(actor.fetch(), 0)
        assert isinstance(actor.gradient(0, (1, 0), values), Accepted)
        assert isinstance(actor.gradient(1, (1, 1), values), Refused)
    assert load_checkpoint(tmp_path / "run").version == 1


def test_a_recorded_run_gives_identical_parameters_when_repeated(free_port: int, tmp_path: Path) -> None:
    config = replace(CONFIG, minutes=5.0)  # so that the learning rates depend on the time
    with (
        running_learner(free_port, tmp_path / "first", config) as endpoint,
        FakeActor(endpoint, "first", "anna") as anna,
        FakeActor(endpoint, "first", "ben") as ben,
    ):
        start = anna.fetch()
        for sequence in range(3):
            for number, actor in enumerate((anna, ben)):
                actor.gradient(sequence, (1, 0), gradient_for(start, 10 * number + sequence))
    with (
        running_learner(free_port, tmp_path / "second", config, replay=tmp_path / "first" / "updates") as endpoint,
        FakeActor(endpoint, "second", "anna", incarnation=77) as anna,
        FakeActor(endpoint, "second", "ben", incarnation=78) as ben,
        HozClient(endpoint) as client,
    ):
        # This time Ben comes first each time; he is told to wait until Anna's gradient was applied.
        start = anna.fetch()
        values = {(n, s): gradient_for(start, 10 * n + s) for n in range(2) for s in range(3)}
        for sequence in range(3):
            waiting = threading.Thread(target=ben.gradient, args=(sequence, (1, 0), values[1, sequence]))
            waiting.start()
            anna.gradient(sequence, (1, 0), values[0, sequence])
            waiting.join()
        status = status_when(client, lambda status: status["finished"])
        assert status["replay"] == {"applied": 6, "total": 6, "diverged": 0}
    first, second = load_checkpoint(tmp_path / "first"), load_checkpoint(tmp_path / "second")
    assert first.parameters.tobytes() == second.parameters.tobytes()


def test_an_actor_that_the_record_does_not_have_is_refused_by_name(free_port: int, tmp_path: Path) -> None:
    with running_learner(free_port, tmp_path / "first") as endpoint, FakeActor(endpoint, "first", "anna") as actor:
        actor.gradient(0, (1, 0), gradient_for(actor.fetch(), 0))
    record = tmp_path / "first" / "updates" / "epoch-0001.jsonl"
    with (
        running_learner(free_port, tmp_path / "second", replay=record) as endpoint,
        FakeActor(endpoint, "second", "box-4711") as actor,
    ):
        refusal = actor.gradient(0, (1, 0), gradient_for(actor.fetch(), 0))
        assert isinstance(refusal, Refused)
        assert refusal.reason == Reason.NAME
        assert "anna" in refusal.detail


def test_a_killed_learner_resumes_and_its_actors_carry_on(free_port: int, tmp_path: Path) -> None:
    run = tmp_path / "run"
    learner = LearnerProcess(free_port, run, "--checkpoint-seconds", "1")
    with learner.ready(), FakeActor(learner.endpoint, "run") as actor, HozClient(learner.endpoint) as client:
        assert isinstance(actor.room_graph(0, graph_of("kitchen/1")), Accepted)
        for sequence in range(3):
            actor.gradient(sequence, (1, sequence), gradient_for(actor.fetch(), sequence))
        wait_for_checkpoint(run, version=3)
        learner.kill()
        with LearnerProcess(free_port, run, "--checkpoint-seconds", "1").ready() as again:
            # A gradient of the old epoch that counted is acknowledged once more; another is refused by name.
            stale = gradient_for(actor.fetch((2, 0)), 9)
            assert isinstance(actor.gradient(2, (1, 2), stale), Accepted)
            refused = actor.gradient(3, (1, 3), stale)
            assert isinstance(refused, Refused)
            assert refused.reason == Reason.EPOCH
            newest = actor.fetch()
            assert newest.head.stamp == (2, 3)
            answer = actor.gradient(4, newest.head.stamp, gradient_for(newest, 4))
            assert isinstance(answer, Accepted)
            assert (answer.epoch, answer.version) == (2, 4)
            status = status_when(client, lambda status: status["epoch"] == 2 and status["version"] == 4)
            assert status["frames"] == 80
            assert client.graph("kitchen").rooms == ("kitchen/1",)
            assert again.stop(signal.SIGTERM) == 0
    saved = load_checkpoint(run)
    assert (saved.epoch, saved.version, saved.frames) == (2, 4, 80)
    assert len(read_updates(run)) == 4
    assert (run / "learner.log").read_text().count("listening at") == 2


def limit_files(learner: LearnerProcess, most_bytes: int) -> None:
    """Let the kernel fail every write of a process beyond that size, as a full disk does."""
    _, hard = resource.prlimit(learner.process.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(learner.process.pid, resource.RLIMIT_FSIZE, (most_bytes, hard))


def test_a_full_disk_does_not_stop_the_training_and_is_said_at_the_end(free_port: int, tmp_path: Path) -> None:
    run = tmp_path / "run"
    with (
        LearnerProcess(free_port, run, "--checkpoint-seconds", "1").ready() as learner,
        FakeActor(learner.endpoint, "run") as actor,
    ):
        limit_files(learner, 1)
        for sequence in range(2):
            assert isinstance(actor.gradient(sequence, (1, sequence), gradient_for(actor.fetch(), sequence)), Accepted)
        assert learner.process.stderr is not None
        while "cannot save a checkpoint" not in (line := learner.process.stderr.readline()):
            assert line, "the learner ended"
        limit_files(learner, resource.RLIM_INFINITY)
        wait_for_checkpoint(run, version=2)
        limit_files(learner, 1)
        assert isinstance(actor.gradient(2, (1, 2), gradient_for(actor.fetch(), 2)), Accepted)
        assert learner.stop(signal.SIGTERM) == 2
        assert "Cannot save the last checkpoint" in learner.process.stderr.read()
    assert load_checkpoint(run).version == 2
    assert len(read_updates(run)) == 2


@pytest.mark.parametrize("step", ["flush", "sync"])
def test_no_checkpoint_is_saved_without_the_record_of_its_updates(
    free_port: int, tmp_path: Path, step: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: UpdateLog) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(UpdateLog, step, fail)
    with (
        pytest.raises(HozError, match="Cannot save the last checkpoint"),
        running_learner(free_port, tmp_path / "run") as endpoint,
        FakeActor(endpoint, "run") as actor,
    ):
        assert isinstance(actor.gradient(0, (1, 0), gradient_for(actor.fetch(), 0)), Accepted)
    assert not list((tmp_path / "run" / "checkpoints").glob("*"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_stop_it_cleanly(free_port: int, tmp_path: Path, number: signal.Signals) -> None:
    with LearnerProcess(free_port, tmp_path / "run").ready() as learner:
        assert learner.stop(number) == 0
        assert learner.process.stderr is not None
        assert "Traceback" not in learner.process.stderr.read()
    assert load_checkpoint(tmp_path / "run").version == 0


def hoz_dist_learner(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "hoz_dist.cli.main", "learner", *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_a_port_in_use_or_a_foreign_folder_is_one_sentence_and_nothing_is_written(
    free_port: int, tmp_path: Path
) -> None:
    foreign = tmp_path / "mine"
    foreign.mkdir()
    (foreign / "notes.txt").write_text("mine")
    with running_learner(free_port, tmp_path / "run") as endpoint:
        in_use = hoz_dist_learner("--listen", endpoint, "--run", str(tmp_path / "other"))
    not_a_run = hoz_dist_learner("--listen", endpoint, "--run", str(foreign))
    for result, words in ((in_use, "in use"), (not_a_run, "not a run")):
        assert result.returncode == 2
        assert words in result.stderr
        assert len(result.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "other").exists()
    assert [path.name for path in foreign.iterdir()] == ["notes.txt"]
