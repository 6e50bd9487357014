"""`hoz-dist train`: a real learner and real actors as its children."""

import os
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hoz_dist.client import HozClient
from hoz_dist.errors import HozError
from learner.checkpoint import Checkpoint, load_checkpoint
from learner.replay import read_updates
from learner.run_folder import read_config
from tests.integration.commands import SMALL_ROOMS, HozDist, children_of, hoz_dist
from tests.integration.learning import LearnerProcess
from tests.waiting import until

pytestmark = pytest.mark.integration

FRAMES = 8000
BUDGET = ("--frames", str(FRAMES), "--seed", "3")


def train_words(run: Path, cache: Path, *options: str) -> list[str]:
    rooms = [word for room in SMALL_ROOMS for word in ("--scene", room)]
    options = (*options, "--run", str(run), "--cache", str(cache), "--episodes", "0")
    return ["train", *rooms, "--actors", "1", *options]


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def assert_same_training(one: Checkpoint, other: Checkpoint) -> None:
    assert one.version == other.version > 0
    assert one.parameters.tobytes() == other.parameters.tobytes()
    assert one.adam.second_moment.tobytes() == other.adam.second_moment.tobytes()


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Path:
    """The folder of a run that one actor has trained to its end."""
    run = tmp_path_factory.mktemp("train") / "runs" / "first"
    result = hoz_dist(*train_words(run, cache, *BUDGET))
    assert result.returncode == 0, result.stderr
    assert "Trained 8," in result.stdout
    assert f"hoz-dist evaluate {run}" in result.stdout
    assert "100%" in result.stderr
    return run


def test_a_run_folder_has_all_that_a_person_wants_to_look_at(trained: Path) -> None:
    checkpoint = load_checkpoint(trained)
    assert checkpoint.frames >= FRAMES
    assert read_config(trained) == checkpoint.config
    assert checkpoint.config.seed == 3
    assert {room.room for room in checkpoint.rooms} == set(SMALL_ROOMS)
    assert next((trained / "tensorboard").glob("events.*")).stat().st_size > 0
    assert (trained / "zones-bathroom.png").read_bytes().startswith(b"\x89PNG")
    assert "listening at" in (trained / "learner.log").read_text()
    assert (trained / "actor-0.log").read_text().endswith("the run is over\n")
    assert len(read_updates(trained)) == checkpoint.version


def test_a_finished_run_is_not_trained_again(trained: Path, cache: Path) -> None:
    before = load_checkpoint(trained)
    result = hoz_dist(*train_words(trained, cache, *BUDGET))
    assert result.returncode == 0, result.stderr
    assert f"The run in {trained} has used up its budget" in result.stdout
    after = load_checkpoint(trained)
    assert_same_training(before, after)
    assert len(read_updates(trained)) == after.version


def test_another_configuration_is_refused_by_name_and_nothing_is_written(trained: Path, cache: Path) -> None:
    before = files_in(trained)
    result = hoz_dist(*train_words(trained, cache, "--frames", str(FRAMES), "--seed", "4"))
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert "seed: 3, 4" in result.stderr
    assert files_in(trained) == before


@pytest.mark.long
def test_one_actor_and_one_seed_give_identical_parameters_again(trained: Path, cache: Path, tmp_path: Path) -> None:
    result = hoz_dist(*train_words(tmp_path / "second", cache, *BUDGET))
    assert result.returncode == 0, result.stderr
    assert_same_training(load_checkpoint(trained), load_checkpoint(tmp_path / "second"))


def test_a_recorded_run_is_repeated_by_a_learner_and_an_actor(
    trained: Path, cache: Path, free_port: int, tmp_path: Path
) -> None:
    run, updates = tmp_path / "again", trained / "updates"
    options = ("--seed", "3", "--zones", "8", "--replay", str(updates), "--exit-when-done")
    rooms = [word for room in SMALL_ROOMS for word in ("--scene", room)]
    with LearnerProcess(free_port, run, *options).ready() as learner:
        words = ["actor", *rooms, "--connect", learner.endpoint, "--name", "actor-0", "--cache", str(cache)]
        with HozDist(*words, log=tmp_path / "actor.log") as actor:
            assert actor.wait() == 0, actor.said
        assert learner.process.wait(30) == 0
    assert_same_training(load_checkpoint(trained), load_checkpoint(run))


@contextmanager
def training(run: Path, cache: Path, log: Path, beyond: int = 0) -> Iterator[HozDist]:
    """Start a training that would take minutes, and wait until it is beyond a version."""
    with HozDist(*train_words(run, cache, "--minutes", "5"), log=log) as train:
        try:
            until(lambda: not train.runs or _version(run) > beyond, "the first updates")
            assert train.runs, train.said
            yield train
        finally:
            if train.runs:
                train.stop(signal.SIGINT)
            for child in children_of(train.process.pid):
                os.kill(child, signal.SIGKILL)


def _version(run: Path) -> int:
    """Ask the learner of a run that `train` has started for the version of the parameters; -1 when there is none."""
    log = run / "learner.log"
    endpoints = re.findall(r"listening at (\S+)", log.read_text()) if log.exists() else []
    try:
        with HozClient(*endpoints[-1:]) as client:
            version = client.status()["version"]
            assert isinstance(version, int)
            return version
    except HozError:
        return -1


def test_ctrl_c_stops_learner_and_actors_and_the_same_command_goes_on(tmp_path: Path, cache: Path) -> None:
    run = tmp_path / "run"
    with training(run, cache, tmp_path / "train.log") as train:
        assert len(children_of(train.process.pid)) == 2
        assert train.stop(signal.SIGINT) == 130
        assert children_of(train.process.pid) == []
    assert "Traceback" not in train.said
    assert (run / "actor-0.log").read_text().endswith("stopped\n")
    stopped_at = load_checkpoint(run)
    assert stopped_at.version > 0

    # Killed, `train` can stop nobody, so its children must see to it themselves, and do it as cleanly.
    with training(run, cache, tmp_path / "again.log", stopped_at.version) as train:
        train.stop(signal.SIGKILL)
        until(lambda: children_of(train.process.pid) == [], "the end of the children")
    killed_at = load_checkpoint(run)
    assert killed_at.epoch == 2
    assert killed_at.version > stopped_at.version
