import json
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

from hoz_dist.cli import measure
from hoz_dist.cli.reproducing import task as reproduce_task
from hoz_dist.cli.reproducing.task import Place, Report
from hoz_dist.evaluation.trials import Evaluation
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.reproduce.job import Job, jobs_of
from hoz_dist.reproduce.outcome import Outcome
from learner.checkpoint import FOLDER, load_checkpoint, save_checkpoint
from learner.core import LearnerCore
from tests.unit.learner.making import CONFIG, vector
from tests.unit.reproduce.making import TABLE, TINY


@pytest.fixture
def benchmark(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every agent fails in the same way."""
    failure = EpisodeResult(RoomId("bathroom", 21), 0, success=False, actions=9, moves=3, said_done=True, optimal=4)
    trials = Evaluation("object", "val", ((failure,),))
    monkeypatch.setattr(measure, "load_agent", lambda *_: None)
    monkeypatch.setattr(reproduce_task, "_benchmark", lambda *_: SimpleNamespace(run=lambda *_, **__: trials))


@pytest.fixture
def job(tmp_path: Path) -> Job:
    """Learners were killed: two after they had kept version 30, one between writing the end and its mark."""
    job = jobs_of(TABLE, TABLE.rows[1], TINY)[0]
    assert job.training is not None
    made = LearnerCore(CONFIG, vector(0), epoch=1).snapshot(now=5.0)
    for epoch, version, keep in ((1, 10, True), (1, 20, True), (2, 30, True), (3, 30, True), (3, 40, False)):
        one = replace(made, epoch=epoch, version=version, frames=100 * version, seconds=version)
        save_checkpoint(job.training.folder(tmp_path) / FOLDER, one, keep=keep)
    return job


@pytest.mark.usefixtures("benchmark")
def test_candidates_are_the_last_that_differ_and_the_end_among_them(tmp_path: Path, job: Job) -> None:
    assert job.training is not None
    reports: list[Report] = []
    chosen, choice = reproduce_task._choose(job, job.training, Place(tmp_path, tmp_path), reports.append)
    assert [one["frames"] for one in choice["candidates"]] == [2000, 3000, 4000]
    assert chosen.version == 40
    assert [report.share for report in reports] == pytest.approx([0, 1 / 3, 2 / 3])


@pytest.mark.usefixtures("benchmark")
def test_a_result_tells_what_it_is_of(tmp_path: Path, job: Job) -> None:
    choice = job.choice(tmp_path)
    choice.write_text(json.dumps({"checkpoint": "0001-000000020.safetensors", "seconds": 1.0}))
    reproduce_task._test(job, Place(tmp_path, tmp_path), lambda _: None)
    facts = Outcome.load(job.result(tmp_path)).facts
    assert (facts["frames"], facts["seconds_to_chosen"], facts["training_seconds"]) == (2000, 20.0, 40.0)
    assert facts["epochs"] == 3  # so that a reader knows that the run was interrupted
    assert facts["libraries"]["torch"] == metadata.version("torch")


@pytest.mark.usefixtures("benchmark")
def test_a_checkpoint_that_is_gone_is_chosen_anew(tmp_path: Path, job: Job) -> None:
    assert job.training is not None
    file = job.choice(tmp_path)
    file.write_text(json.dumps({"checkpoint": "0001-000000050.safetensors", "seconds": 1.0}))
    chosen, choice = reproduce_task._choose(job, job.training, Place(tmp_path, tmp_path), lambda _: None)
    assert (chosen.version, choice["checkpoint"]) == (40, "0003-000000040.safetensors")
    assert json.loads(file.read_text()) == choice


@pytest.mark.usefixtures("benchmark")
def test_a_choice_holds_for_the_checkpoint_that_was_chosen_alone(tmp_path: Path, job: Job) -> None:
    assert job.training is not None
    place, folder = Place(tmp_path, tmp_path), job.training.folder(tmp_path) / FOLDER
    _, choice = reproduce_task._choose(job, job.training, place, lambda _: None)
    # As long as the training is the same, nothing is chosen again.
    job.choice(tmp_path).write_text(json.dumps(choice | {"seconds": -1.0}))
    assert reproduce_task._choose(job, job.training, place, lambda _: None)[1]["seconds"] == -1.0

    trained_again = replace(load_checkpoint(folder / choice["checkpoint"]), frames=4321, seconds=99.0)
    assert save_checkpoint(folder, trained_again).name == choice["checkpoint"]
    chosen, again = reproduce_task._choose(job, job.training, place, lambda _: None)
    assert (chosen.frames, again["candidates"][-1]["frames"]) == (4321, 4321)
    assert again["seconds"] >= 0.0
    assert json.loads(job.choice(tmp_path).read_text()) == again
