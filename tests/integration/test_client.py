"""HozClient, and the commands query and status, against a real server."""

import json
import os
import pty
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import msgpack
import numpy as np
import pytest
import zenoh

from hoz_dist.cli.main import run
from hoz_dist.client import HozClient
from hoz_dist.errors import ConnectionFailedError, HozError, InvalidValueError, NotFoundError, UnknownNameError
from hoz_dist.graph.files import load_graph
from hoz_dist.graph.planner import plan_for
from hoz_dist.nav.categories import TARGETS
from hoz_dist.waiting import StoppedError
from hoz_dist.wire.client.discovery import find_run
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.queryable import declare_queryable
from hoz_dist.wire.transport.session import open_client, open_router
from tests import wire_samples as samples

pytestmark = pytest.mark.integration
KEYS = samples.KEYS
PLAN = plan_for(samples.scene_graph(), "Microwave", ["Sink", "Toaster"], "product")


@pytest.fixture
def endpoint(free_port: int) -> str:
    return f"tcp/127.0.0.1:{free_port}"


@pytest.fixture
def learner(endpoint: str) -> Iterator[Server]:
    with samples.serving(endpoint) as (server, _):
        server.put_graph(samples.scene_graph())
        server.put_graph(samples.room_graph())
        yield server


@pytest.fixture
def client(learner: Server, endpoint: str) -> Iterator[HozClient]:
    with HozClient(endpoint) as client:
        yield client


# --- the client ---


def test_a_client_that_asks_again_gets_what_is_new_and_may_change_what_it_got(
    learner: Server, client: HozClient
) -> None:
    expected = samples.scene_graph()
    for _ in range(2):
        graph = client.graph("kitchen")
        np.testing.assert_array_equal(graph.nodes, expected.nodes)
        graph.nodes[:] = 0.0
    learner.put_graph(samples.scene_graph(version=3))
    assert client.graph("kitchen").version == 3


def test_a_client_gets_graphs_plans_status_and_configuration(client: HozClient) -> None:
    graph, expected = client.graph("kitchen"), samples.scene_graph()
    assert (graph.scene, graph.version, graph.rooms, graph.categories) == ("kitchen", 2, expected.rooms, TARGETS)
    np.testing.assert_array_equal(graph.nodes, expected.nodes)
    np.testing.assert_array_equal(graph.edges, expected.edges)
    room = client.room_graph("kitchen/3")
    assert (room.room, room.digest) == ("kitchen/3", "d1")
    np.testing.assert_array_equal(room.nodes, samples.room_graph().nodes)
    assert client.plan("kitchen", "microwave", ["Sink", "toaster"]) == PLAN
    assert client.runs() == ["run-1"]
    config = client.config()
    assert config == {
        "protocol": 2,
        "run": "run-1",
        "epoch": 1,
        "categories": list(TARGETS),
        "config": {"method": "hoz", "seed": 3, "learning_rate": 1e-3, "minutes": None},
    }
    status = client.status()
    assert (status["version"], status["epoch"], status["rejected"]) == (5, 1, {"epoch": 1})
    assert [(process["role"], process["id"]) for process in status["processes"]] == [("actor", "a0"), ("learner", "l0")]
    assert status["progress"] == 0.25


def test_a_learner_that_computes_still_answers(client: HozClient) -> None:
    # Nobody takes anything out of the server's inbox here: answers do not wait for the learner.
    began = time.monotonic()
    for _ in range(20):
        client.plan("kitchen", "Pan", ["Sink"])
    assert (time.monotonic() - began) / 20 < 0.1


def test_names_are_checked_before_anybody_is_asked(client: HozClient) -> None:
    with pytest.raises(UnknownNameError, match="Unknown scene 'kichen'"):
        client.graph("kichen")
    with pytest.raises(UnknownNameError, match="Unknown room 'kitchen/31'"):
        client.room_graph("kitchen/31")
    with pytest.raises(UnknownNameError, match="Unknown target 'Sofa'"):
        client.plan("kitchen", "Sofa", ["Sink"])
    with pytest.raises(UnknownNameError, match="Unknown target 'Sink;target=Pan'"):
        client.plan("kitchen", "Pan", ["Sink;target=Pan"])


def test_what_the_learner_cannot_answer_is_said_in_its_words(client: HozClient) -> None:
    with pytest.raises(NotFoundError, match="There is no graph of 'bathroom' yet"):
        client.graph("bathroom")
    with pytest.raises(NotFoundError, match="There is no graph of 'kitchen/4' yet"):
        client.room_graph("kitchen/4")
    with pytest.raises(NotFoundError, match="There is no graph of 'bedroom' yet"):
        client.plan("bedroom", "Book", ["Laptop"])
    with pytest.raises(InvalidValueError, match="name at least one category"):
        client.plan("kitchen", "Pan", [])


def test_a_client_of_a_router_without_a_learner_says_so(endpoint: str) -> None:
    with open_router(endpoint), HozClient(endpoint) as client:
        assert client.runs() == []
        with pytest.raises(NotFoundError, match="The router answers, but no learner"):
            client.status()


def test_one_of_several_runs_must_be_named(learner: Server, endpoint: str) -> None:
    snapshots = Snapshots(samples.config_reply(), samples.status_reply, "product")
    object.__setattr__(snapshots.config, "run", "other")
    with open_client(endpoint) as second, Server(second, Keys("other"), snapshots):
        with HozClient(endpoint) as client:
            assert client.runs() == ["other", "run-1"]
            with pytest.raises(InvalidValueError, match="There are several runs: other, run-1; choose one with --run"):
                client.status()
        with HozClient(endpoint, run="run-1") as client:
            assert client.graph("kitchen").version == 2
        with HozClient(endpoint, run="third") as client, pytest.raises(NotFoundError, match="there are: other, run-1"):
            client.graph("kitchen")


def test_a_client_survives_a_restart_of_the_learner_and_says_when_it_is_away(endpoint: str) -> None:
    with samples.serving(endpoint) as (server, _):
        server.put_graph(samples.scene_graph())
        client = HozClient(endpoint)
        assert client.graph("kitchen").version == 2
    with client:
        with pytest.raises(ConnectionFailedError, match="does not answer; it may have stopped"):
            client.graph("kitchen")
        with samples.serving(endpoint) as (server, _):
            server.put_graph(samples.scene_graph(version=3))
            end = time.monotonic() + 10
            while time.monotonic() < end:
                try:
                    assert client.graph("kitchen").version == 3
                except (ConnectionFailedError, NotFoundError):
                    continue
                return
    pytest.fail("the client did not come back")


def test_a_learner_of_another_protocol_version_is_named(endpoint: str) -> None:
    strange = msgpack.packb({"v": 9, "kind": "config"})
    with open_router(endpoint) as session:
        key = Keys("next").config

        def answer(query: zenoh.Query) -> None:
            with query:
                query.reply(key, strange)

        queryable = declare_queryable(session, key, answer)
        with HozClient(endpoint) as client:
            with pytest.raises(HozError, match="protocol version 9; this side speaks 2"):
                client.status()
            # A learner of our own version is found all the same.
            with Server(session, KEYS, Snapshots(samples.config_reply(), samples.status_reply, "product")):
                assert client.runs() == [KEYS.run]
                assert client.status()["version"] == 5
            with HozClient(endpoint, run="next") as named, pytest.raises(HozError, match="protocol version 9"):
                named.status()
        queryable.close()


def test_two_learners_of_one_run_are_said_to_be_two(learner: Server, endpoint: str) -> None:
    snapshots = Snapshots(samples.config_reply(), samples.status_reply, "product")
    with open_client(endpoint) as second, Server(second, KEYS, snapshots):
        for run in (None, KEYS.run):
            with (
                HozClient(endpoint, run=run) as client,
                pytest.raises(InvalidValueError, match="2 learners serve a run named 'run-1'"),
            ):
                client.status()


def test_a_run_is_looked_for_until_its_learner_answers(endpoint: str) -> None:
    found = []
    with open_router(endpoint) as session, open_client(endpoint) as client:
        looking = threading.Thread(target=lambda: found.append(find_run(client, KEYS.run, timeout_s=20.0)))
        looking.start()
        with pytest.raises(NotFoundError, match="hoz-dist learner --listen"):
            find_run(client, None, timeout_s=0.3)
        with Server(session, KEYS, Snapshots(samples.config_reply(), samples.status_reply, "product")):
            looking.join(20.0)
    assert [config.run for config in found] == [KEYS.run]


def test_a_stopped_process_does_not_look_for_a_run(endpoint: str) -> None:
    stop = threading.Event()
    stop.set()
    with open_router(endpoint), open_client(endpoint) as client, pytest.raises(StoppedError):
        find_run(client, None, timeout_s=60.0, stop=stop)


# --- the commands ---


def output_of(capfdbinary: pytest.CaptureFixture[bytes], *arguments: str) -> bytes:
    assert run(list(arguments)) == 0
    out, err = capfdbinary.readouterr()
    assert err == b""
    return out


def sentence_of(capfdbinary: pytest.CaptureFixture[bytes], *arguments: str) -> str:
    assert run(list(arguments)) == 2
    out, err = capfdbinary.readouterr()
    assert out == b""
    assert err.count(b"\n") == 1
    return err.decode()


def test_query_prints_the_graph_as_json(
    learner: Server, endpoint: str, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    graph = json.loads(output_of(capfdbinary, "query", "kitchen", "--connect", endpoint, "--format", "json"))
    expected = samples.scene_graph()
    assert graph == {
        "scene": "kitchen",
        "version": 2,
        "rooms": ["kitchen/1", "kitchen/3"],
        "categories": list(TARGETS),
        "nodes": expected.nodes.tolist(),
        "edges": expected.edges.tolist(),
    }


def test_query_prints_a_plan_as_json(learner: Server, endpoint: str, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    arguments = ("query", "kitchen", "--connect", endpoint, "--target", "Microwave", "--seen", "Sink, Toaster")
    assert json.loads(output_of(capfdbinary, *arguments, "--format", "json")) == PLAN.as_dict()
    assert msgpack.unpackb(output_of(capfdbinary, *arguments, "--format", "msgpack")) == PLAN.as_dict()
    text = output_of(capfdbinary, *arguments).decode()
    assert f"Path: {' > '.join(map(str, PLAN.path))}" in text


@pytest.mark.parametrize("extension", ["json", "msgpack", "mat"])
def test_query_writes_files_that_graph_commands_read(
    learner: Server, endpoint: str, tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes], extension: str
) -> None:
    path = tmp_path / f"kitchen.{extension}"
    arguments = ("query", "kitchen", "--connect", endpoint, "--output", str(path))
    assert output_of(capfdbinary, *arguments).decode() == f"Wrote {path}.\n"
    np.testing.assert_array_equal(load_graph(path).nodes, samples.scene_graph().nodes)
    assert "exists already" in sentence_of(capfdbinary, *arguments)
    assert output_of(capfdbinary, *arguments, "--force")
    # The same bytes go to a pipe.
    piped = output_of(capfdbinary, "query", "kitchen", "--connect", endpoint, "--format", extension)
    if extension != "mat":  # it holds the time of writing
        assert piped.rstrip(b"\n") == path.read_bytes().rstrip(b"\n")


def test_query_prints_a_room_tables_and_a_drawing(
    learner: Server, endpoint: str, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    room = json.loads(output_of(capfdbinary, "query", "kitchen/3", "--connect", endpoint, "--format", "json"))
    assert room["rooms"] == ["kitchen/3"]
    assert room["nodes"] == samples.room_graph().nodes.tolist()
    table = output_of(capfdbinary, "query", "kitchen", "--connect", endpoint).decode()
    assert "Scene graph of kitchen of 2 rooms, version 2" in table
    assert "zone" in table
    drawing = output_of(capfdbinary, "query", "kitchen", "--connect", endpoint, "--format", "dot").decode()
    assert drawing.startswith('graph "kitchen" {')
    assert drawing.count(" -- ") == 8 * 7 / 2


def test_query_says_in_one_sentence_what_is_wrong(
    learner: Server, endpoint: str, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    for words, sentence in {
        "kichen": "Unknown scene 'kichen'. Did you mean 'kitchen'?",
        "kitchen/99": "Unknown room 'kitchen/99'",
        "bathroom": "There is no graph of 'bathroom' yet",
        "kitchen --target Sofa --seen Sink": "Unknown target 'Sofa'",
        "kitchen --target Pan": "A plan needs both --target",
        "kitchen --seen Pan": "A plan needs both --target",
        "kitchen --target Pan --seen Sink --format mat": "A plan has no mat form",
        "kitchen --run nobody": "No learner of the run 'nobody' answers; there are: run-1.",
        "kitchen --run a/b": "The run name 'a/b' cannot be used",
    }.items():
        assert sentence in sentence_of(capfdbinary, "query", "--connect", endpoint, *words.split())


def test_commands_say_that_nobody_answers(endpoint: str, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    for command in (["query", "kitchen"], ["status"]):
        assert f"No learner or router answers at {endpoint}" in sentence_of(
            capfdbinary, *command, "--connect", endpoint
        )
    assert "is not an endpoint" in sentence_of(capfdbinary, "status", "--connect", "localhost")


def test_query_does_not_write_bytes_to_a_terminal(learner: Server, endpoint: str) -> None:
    main, terminal = pty.openpty()
    command = [sys.executable, "-m", "hoz_dist.cli.main", "query", "kitchen", "--connect", endpoint, "--format", "mat"]
    done = subprocess.run(command, check=False, stdout=terminal, stderr=subprocess.PIPE, text=True)
    os.close(terminal)
    os.close(main)
    assert done.returncode == 2
    assert "mat is no text for a terminal" in done.stderr


def test_status_prints_json_and_a_table(
    learner: Server, endpoint: str, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    status = json.loads(output_of(capfdbinary, "status", "--connect", endpoint, "--json"))
    assert status["version"] == 5
    assert status["epoch"] == 1
    assert status["rejected"] == {"epoch": 1}
    assert {"role": "learner", "id": "l0"}.items() <= status["processes"][1].items()
    table = output_of(capfdbinary, "status", "--connect", endpoint).decode()
    for told in ("version 5 of epoch 1", "800 frames", "25% done", "kitchen/3", "Rejected messages: epoch 1"):
        assert told in table


def test_the_whole_query_command_takes_less_than_a_second_and_a_half(learner: Server, endpoint: str) -> None:
    command = [sys.executable, "-m", "hoz_dist.cli.main", "query", "kitchen", "--connect", endpoint, "--format", "json"]
    times = []
    for _ in range(3):
        began = time.monotonic()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.monotonic() - began)
    assert sorted(times)[1] <= 1.5


def test_clients_leave_no_thread_behind(learner: Server, endpoint: str) -> None:
    before = set(threading.enumerate())
    with HozClient(endpoint) as client:
        client.graph("kitchen")
    assert set(threading.enumerate()) == before
