"""Membership over real Zenoh, and `hoz-dist status --watch` while learner and router are killed and come back."""

import json
import os
import pty
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.main import run
from hoz_dist.client import HozClient
from hoz_dist.wire.membership.liveliness import Member, Members, declare_alive
from hoz_dist.wire.membership.roster import MOST_LIVE
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.transport.environment import child_environment
from hoz_dist.wire.transport.session import open_client, open_router
from tests import wire_samples as samples
from tests.integration.commands import HozDist
from tests.integration.learning import FakeActor, LearnerProcess, running_learner, status_when
from tests.waiting import until

pytestmark = pytest.mark.integration

KEYS = Keys("run-1")
ANNA = Member("actor", "anna", "h1", 7)


@pytest.fixture
def endpoint(free_port: int) -> str:
    return f"tcp/127.0.0.1:{free_port}"


def left_in(status: dict[str, Any]) -> list[tuple[str, str, int]]:
    return [(one["role"], one["id"], one["incarnation"]) for one in status["left"]]


def live_actors(status: dict[str, Any]) -> list[tuple[str, int]]:
    return [(one["id"], one["incarnation"]) for one in status["processes"] if one["role"] == "actor"]


def test_a_learner_tells_who_left_until_it_comes_back(free_port: int, tmp_path: Path) -> None:
    with running_learner(free_port, tmp_path / "run") as endpoint, HozClient(endpoint) as client:
        with FakeActor(endpoint, "run", "anna", 1), FakeActor(endpoint, "run", "ben", 2) as ben:
            ben.episodes(0, ("kitchen/1", True))
            both = status_when(client, lambda status: live_actors(status) == [("anna", 1), ("ben", 2)])
            assert both["left"] == []
            status_when(client, lambda status: any(one["rooms"] == ["kitchen/1"] for one in status["processes"]))
        gone = status_when(client, lambda status: len(status["left"]) == 2)
        assert live_actors(gone) == []
        assert {name for _, name, _ in left_in(gone)} == {"anna", "ben"}
        assert all(one["host"] == "host" and 0.0 <= one["seconds"] < 30.0 for one in gone["left"])
        with FakeActor(endpoint, "run", "ben", 3):
            back = status_when(client, lambda status: live_actors(status) == [("ben", 3)])
            assert left_in(back) == [("actor", "anna", 1)]
            # What the process before it measured is not shown as its own.
            assert [one["rooms"] for one in back["processes"] if one["role"] == "actor"] == [[]]


def test_two_live_actors_of_one_name_are_both_listed(
    free_port: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with (
        running_learner(free_port, tmp_path / "run") as endpoint,
        HozClient(endpoint) as client,
        FakeActor(endpoint, "run", "anna", 1),
        FakeActor(endpoint, "run", "anna", 2) as second,
    ):
        second.episodes(0, ("kitchen/1", True))
        twins = status_when(
            client, lambda status: any(one["rooms"] for one in status["processes"]) and len(live_actors(status)) > 1
        )
        actors = [one for one in twins["processes"] if one["role"] == "actor"]
        assert {one["incarnation"]: one["rooms"] for one in actors} == {1: [], 2: ["kitchen/1"]}
        capfd.readouterr()
        assert run(["status", "--connect", endpoint]) == 0
        assert "Live actors share a name: anna on host and host." in capfd.readouterr().out


def test_a_flood_of_tokens_is_bounded_and_hides_nobody_else(endpoint: str) -> None:
    with (
        open_router(endpoint) as session,
        Members(session, KEYS) as members,
        open_client(endpoint) as stranger,
        open_client(endpoint) as honest,
    ):
        many = MOST_LIVE["actor"] + 500
        flood = [declare_alive(stranger, KEYS, Member("actor", f"x{number}", "h", 1)) for number in range(many)]
        until(lambda: len(members.current()) >= MOST_LIVE["actor"], "the flood")
        with declare_alive(honest, KEYS, Member("standby", "l1", "h1", 5)):
            until(lambda: any(member.role == "standby" for member in members.current()), "the standby")
        for token in flood:
            token.undeclare()  # type: ignore[no-untyped-call]
        until(lambda: not members.current(), "the end of the flood")
        with declare_alive(honest, KEYS, ANNA):
            until(lambda: members.current() == (ANNA,), "anna")


@pytest.mark.parametrize(
    "key",
    [
        "alive/king/anna/h1/1",
        "alive/actor/anna/h1/01",
        "alive/actor/anna/h1/-1",
        "alive/actor/anna/h1/9223372036854775808",
        "alive/actor/anna/h1/" + "0" * 5000 + "1",
        "alive/actor/_anna/h1/1",
        "alive/actor/an na/h1/1",
    ],
)
def test_tokens_that_no_process_of_ours_has_are_left_out(endpoint: str, key: str) -> None:
    with open_router(endpoint) as session, Members(session, KEYS) as members, open_client(endpoint) as stranger:
        token = stranger.liveliness().declare_token(f"hoz/{KEYS.run}/{key}")
        with declare_alive(stranger, KEYS, ANNA):
            until(lambda: members.current() != (), "anna")
            assert members.current() == (ANNA,)
        token.undeclare()  # type: ignore[no-untyped-call]


def test_members_are_known_again_after_the_router_was_killed(endpoint: str, tmp_path: Path) -> None:
    ben = Member("actor", "ben", "h1", 8)
    router = ("router", "--listen", endpoint)
    with (
        HozDist(*router, log=tmp_path / "first.log") as first,
        open_client(endpoint, 20.0) as session,
        Members(session, KEYS) as members,
        open_client(endpoint, 20.0) as one,
        open_client(endpoint, 20.0) as other,
        declare_alive(one, KEYS, ANNA),
    ):
        token = declare_alive(other, KEYS, ben)
        until(lambda: members.current() == (ANNA, ben), "both")
        first.stop(signal.SIGKILL)
        until(lambda: members.current() == (), "silence")
        token.undeclare()  # type: ignore[no-untyped-call]
        with HozDist(*router, log=tmp_path / "second.log"):
            until(lambda: members.current() == (ANNA,), "anna")
            assert [departure.member for departure in members.left()] == [ben]


@pytest.fixture
def watching(endpoint: str, tmp_path: Path) -> Iterator[HozDist]:
    words = ("status", "--watch", "--every", "0.2", "--json", "--connect", endpoint)
    with HozDist(*words, log=tmp_path / "watch.log") as process:
        yield process


def answers(process: HozDist) -> list[dict[str, Any]]:
    return [json.loads(line) for line in process.said.splitlines() if line.endswith("}")]


def test_a_watch_survives_the_router_and_the_learner_in_it(watching: HozDist, endpoint: str) -> None:
    until(lambda: any("silent_since" in answer for answer in answers(watching)), "a line without a learner")
    for epoch in (1, 2):
        with samples.serving(endpoint, epoch):
            until(lambda: bool(answers(watching)) and "version" in answers(watching)[-1], "a status")
        until(lambda: "silent_since" in answers(watching)[-1], "silence")
    assert watching.stop(signal.SIGINT) == 0
    assert all(answer["problem"].endswith(".") for answer in answers(watching) if "problem" in answer)


def test_a_watch_of_a_killed_learner_goes_on_with_the_next(watching: HozDist, free_port: int, tmp_path: Path) -> None:
    for epoch in (1, 2):
        with LearnerProcess(free_port, tmp_path / "run") as learner:
            until(lambda epoch=epoch: any(one.get("epoch") == epoch for one in answers(watching)), f"epoch {epoch}")  # type: ignore[misc]
            learner.kill()
        until(lambda: "silent_since" in answers(watching)[-1], "silence")
    assert watching.stop(signal.SIGTERM) == 0


def test_a_watch_that_cannot_succeed_ends_with_a_sentence(tmp_path: Path) -> None:
    with HozDist("status", "--watch", "--connect", "localhost", log=tmp_path / "watch.log") as process:
        assert process.wait() == 2
        assert "is not an endpoint" in process.said


def test_on_a_terminal_a_watch_is_renewed_in_place(endpoint: str) -> None:
    main, terminal = pty.openpty()
    command = [sys.executable, "-m", "hoz_dist.cli.main", "status", "--watch", "--every", "0.1", "--connect", endpoint]
    with samples.serving(endpoint):
        environment = child_environment() | {"TERM": "xterm", "COLUMNS": "120", "LINES": "40"}
        process = subprocess.Popen(command, stdout=terminal, stderr=terminal, env=environment)
        os.close(terminal)
        shown = b""
        while shown.count(b"Live processes") < 3:
            shown += os.read(main, 65536)
        process.send_signal(signal.SIGINT)
        assert process.wait(10.0) == 0
    os.close(main)
    text = shown.decode()
    assert "\x1b[1A" in text  # up a line: the page before is written over
    assert "kitchen/3" in text
