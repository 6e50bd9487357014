"""Real actor processes that train for a real learner in real rooms."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hoz_dist.client import HozClient
from hoz_dist.nav.categories import TARGETS
from learner.checkpoint import load_checkpoint
from tests.integration.commands import SMALL_ROOMS, HozDist
from tests.integration.learning import (
    CONFIG,
    LearnerProcess,
    running_learner,
    status_when,
    wait_for_checkpoint,
)

pytestmark = pytest.mark.integration

QUICK = replace(CONFIG, batch=8)


@contextmanager
def running_actor(endpoint: str, name: str, folder: Path, cache: Path) -> Iterator[HozDist]:
    rooms = [word for room in SMALL_ROOMS for word in ("--scene", room)]
    words = ["actor", *rooms, "--connect", endpoint, "--name", name, "--cache", str(cache)]
    with HozDist(*words, log=folder / f"{name}.log") as actor:
        yield actor


def actors_in(status: dict[str, object]) -> list[str]:
    """Return the names of the actors that hold a live token."""
    processes = status["processes"]
    assert isinstance(processes, list)
    return [process["id"] for process in processes if process["role"] == "actor"]


def rooms_in(status: dict[str, Any]) -> list[str]:
    """Return the bathrooms whose graphs the learner has: an actor trains in its first while it prepares the next."""
    scenes = status["scenes"]
    return list(scenes["bathroom"]["rooms"]) if "bathroom" in scenes else []


def test_an_actor_explores_trains_and_stops_on_ctrl_c(free_port: int, tmp_path: Path, cache: Path) -> None:
    with (
        running_learner(free_port, tmp_path / "run", QUICK) as endpoint,
        HozClient(endpoint) as client,
        running_actor(endpoint, "anna", tmp_path, cache) as actor,
    ):
        rooms = list(SMALL_ROOMS)
        status = status_when(
            client,
            lambda status: status["episodes"] > 0 and actors_in(status) == ["anna"] and rooms_in(status) == rooms,
        )
        first = status["version"]
        assert first > 0
        graph = client.graph("bathroom")
        assert list(graph.rooms) == rooms
        assert graph.nodes.shape == (QUICK.zones, len(TARGETS))
        assert graph.edges.shape == (QUICK.zones, QUICK.zones)
        np.testing.assert_array_equal(graph.edges, graph.edges.T)
        assert graph.nodes[:, TARGETS.index("Sink")].max() > 0.5  # what it saw there
        assert client.plan("bathroom", "Sink", ["LightSwitch"]).target == graph.nodes[:, TARGETS.index("Sink")].argmax()
        status = status_when(client, lambda status: status["version"] > first + 2)
        process = status["processes"][0]
        assert set(process["rooms"]) == set(rooms)
        assert process["frames"] > 0
        assert process["rejected"] == 0

        assert actor.stop(signal.SIGINT) == 0
        status_when(client, lambda status: actors_in(status) == [])
    assert actor.said.endswith("stopped\n")
    assert "Traceback" not in actor.said


def test_training_goes_on_without_a_killed_actor_and_with_the_next(free_port: int, tmp_path: Path, cache: Path) -> None:
    with (
        running_learner(free_port, tmp_path / "run", QUICK) as endpoint,
        HozClient(endpoint) as client,
        running_actor(endpoint, "anna", tmp_path, cache),
    ):
        with running_actor(endpoint, "ben", tmp_path, cache) as ben:
            status_when(
                client,
                lambda status: (
                    actors_in(status) == ["anna", "ben"]
                    and all(process["frames"] > 0 for process in status["processes"] if process["role"] == "actor")
                    and rooms_in(status) == list(SMALL_ROOMS)
                ),
            )
            ben.stop(signal.SIGKILL)
        alone = status_when(client, lambda status: actors_in(status) == ["anna"])
        later = status_when(client, lambda status: status["version"] > alone["version"] + 2)
        with running_actor(endpoint, "ben", tmp_path, cache):
            again = status_when(client, lambda status: actors_in(status) == ["anna", "ben"])
            frames = {process["id"]: process["frames"] for process in again["processes"]}
            status_when(
                client,
                lambda status: any(
                    process["id"] == "ben" and process["frames"] > frames["ben"] for process in status["processes"]
                ),
            )
    assert later["rejected"] == {}


def test_actors_carry_on_with_a_learner_that_was_killed_and_started_again(
    free_port: int, tmp_path: Path, cache: Path
) -> None:
    run = tmp_path / "run"
    with (
        LearnerProcess(free_port, run, "--checkpoint-seconds", "1").ready() as learner,
        running_actor(learner.endpoint, "anna", tmp_path, cache) as actor,
    ):
        wait_for_checkpoint(run, version=3)
        learner.kill()
        saved = load_checkpoint(run)
        with LearnerProcess(free_port, run, "--checkpoint-seconds", "1").ready() as again:
            with HozClient(again.endpoint) as client:
                status = status_when(
                    client,
                    lambda status: status["version"] > saved.version + 2 and rooms_in(status) == list(SMALL_ROOMS),
                )
                assert status["epoch"] == 2
                assert status["frames"] > saved.frames
                assert actors_in(status) == ["anna"]
                assert list(client.graph("bathroom").rooms) == list(SMALL_ROOMS)
            assert actor.runs
            assert again.stop(signal.SIGTERM) == 0
        # It waits for the learner now, and can be stopped all the same.
        assert actor.runs
        assert actor.stop(signal.SIGTERM) == 0
    assert "Traceback" not in actor.said
    resumed = load_checkpoint(run)
    assert resumed.epoch == 2
    assert resumed.version > saved.version


def test_an_actor_ends_by_itself_when_the_budget_is_used_up(free_port: int, tmp_path: Path, cache: Path) -> None:
    config = replace(QUICK, frames=500)
    with (
        running_learner(free_port, tmp_path / "run", config) as endpoint,
        HozClient(endpoint) as client,
        running_actor(endpoint, "anna", tmp_path, cache) as actor,
    ):
        assert actor.wait() == 0
        assert actor.said.endswith("the run is over\n")
        assert status_when(client, lambda status: status["finished"])["frames"] >= 500
        # One that comes late is told so too.
        with running_actor(endpoint, "ben", tmp_path, cache) as late:
            assert late.wait() == 0
