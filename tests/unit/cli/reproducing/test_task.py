import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from hoz_dist.cli import measure
from hoz_dist.cli.reproducing import task as reproduce_task
from hoz_dist.cli.reproducing.task import Place, Report
from hoz_dist.config import RunConfig
from hoz_dist.evaluation.agents import RandomAgent
from hoz_dist.evaluation.protocol import TEMPERATURE
from hoz_dist.evaluation.trials import Evaluation
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId, rooms_of
from hoz_dist.reproduce.job import Job, jobs_of
from hoz_dist.reproduce.outcome import Outcome
from learner.checkpoint import FOLDER, load_checkpoint, save_checkpoint
from learner.core import LearnerCore
from tests.unit.learner.making import CONFIG, vector
from tests.unit.reproduce.making import TABLE, TINY

OPTIMAL = 4
SURE = (OPTIMAL + 1,) * 5
"""Actions of an agent that succeeds in every episode on the shortest way."""


class Played(NamedTuple):
    """An agent as it was made, of the checkpoint of a version."""

    version: int
    config: RunConfig
    temperature: float


class Asked(NamedTuple):
    """What a benchmark was asked for."""

    agent: Any
    split: str
    rooms: tuple[RoomId, ...]
    episodes: int
    picture_size: int
    seeds: tuple[int, ...]


@dataclass
class Benchmarks:
    """Benchmarks without rooms: they note what they are asked, and every agent does as the test says."""

    actions: dict[int, tuple[int, ...]] = field(default_factory=dict)
    """By version, what an agent takes to succeed in an episode of each room in turn; 0 where it fails, as others do."""
    asked: list[Asked] = field(default_factory=list)

    def open(self, _: Place, picture_size: int, rooms: tuple[RoomId, ...], split: str, episodes: int) -> Any:
        def run(agent: Any, seeds: Sequence[int], progress: Callable[[int, int], None] | None = None) -> Evaluation:
            del progress
            self.asked.append(Asked(agent, split, rooms, episodes, picture_size, tuple(seeds)))
            of_rooms = self.actions.get(agent.version, ()) if isinstance(agent, Played) else ()
            trial = tuple(map(result, rooms, of_rooms or (0,) * len(rooms)))
            return Evaluation("object", split, (trial,) * len(seeds))

        return SimpleNamespace(rooms=rooms, run=run)


def result(room: RoomId, actions: int) -> EpisodeResult:
    """Of an episode in which an agent succeeds after some actions; 0: it fails."""
    return EpisodeResult(room, 0, success=actions > 0, actions=actions or 9, moves=3, said_done=True, optimal=OPTIMAL)


@pytest.fixture
def benchmark(monkeypatch: pytest.MonkeyPatch) -> Benchmarks:
    """Every agent fails, unless the test says otherwise."""
    benchmarks = Benchmarks()

    def load_agent(config: RunConfig, parameters: Any, _: object, temperature: float) -> Played:
        return Played(int(parameters[0]), config, temperature)

    monkeypatch.setattr(measure, "load_agent", load_agent)
    monkeypatch.setattr(reproduce_task, "_benchmark", benchmarks.open)
    return benchmarks


def trained(job: Job, out: Path) -> Job:
    """Learners were killed: two after they had kept version 30, one between writing the end and its mark."""
    assert job.training is not None
    made = LearnerCore(CONFIG, vector(0), epoch=1).snapshot(now=5.0)
    for epoch, version, keep in ((1, 10, True), (1, 20, True), (2, 30, True), (3, 30, True), (3, 40, False)):
        one = replace(
            made,
            epoch=epoch,
            version=version,
            frames=100 * version,
            seconds=version,
            parameters=np.full_like(made.parameters, version),
        )
        save_checkpoint(job.training.folder(out) / FOLDER, one, keep=keep)
    return job


@pytest.fixture
def job(tmp_path: Path) -> Job:
    """Of a row that is tested as it was trained."""
    return trained(jobs_of(TABLE, TABLE.rows[1], TINY)[0], tmp_path)


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


@pytest.mark.parametrize(
    ("actions", "best"),
    [
        # The one that succeeds most often, though it came first and takes long.
        ({20: (40, 40, 40, 0, 0), 30: (5, 5, 0, 0, 0), 40: (5, 0, 0, 0, 0)}, 20),
        ({20: (5, 5, 0, 0, 0), 30: (40, 40, 40, 0, 0), 40: (0, 0, 0, 0, 0)}, 30),
        # Of equals the one that takes the shorter ways.
        ({20: (9, 9, 9, 0, 0), 30: (5, 9, 9, 0, 0), 40: (9, 9, 9, 0, 0)}, 30),
        # Of equals in both the later one.
        ({20: (5, 0, 0, 0, 0), 30: (9, 9, 0, 0, 0), 40: (0, 9, 9, 0, 0)}, 40),
    ],
)
def test_the_best_on_validation_rooms_is_chosen(
    tmp_path: Path, job: Job, benchmark: Benchmarks, actions: dict[int, tuple[int, ...]], best: int
) -> None:
    assert job.training is not None
    benchmark.actions = {10: SURE, **actions}  # version 10 is too old to be a candidate
    chosen, choice = reproduce_task._choose(job, job.training, Place(tmp_path, tmp_path), lambda _: None)
    assert (chosen.version, chosen.parameters[0]) == (best, best)
    assert choice["checkpoint"] == chosen.file_name
    succeeded = [100 * sum(number > 0 for number in actions[version]) / 5 for version in (20, 30, 40)]
    assert [one["sr"] for one in choice["candidates"]] == succeeded

    # Each was tried once, as it was trained, on episodes that no test has.
    rooms, size = rooms_of("bathroom", "val"), job.training.config.picture_size
    assert benchmark.asked == [
        Asked(Played(version, CONFIG, TEMPERATURE), "val", rooms, TINY.validation_episodes, size, (0,))
        for version in (20, 30, 40)
    ]


def test_the_chosen_agent_is_tested_on_test_rooms_as_its_row_says(tmp_path: Path, benchmark: Benchmarks) -> None:
    row = TABLE.rows[2]
    job = trained(jobs_of(TABLE, row, TINY)[1], tmp_path)
    assert job.training is not None
    # The best came first, so it is neither the newest nor the one with the most frames.
    benchmark.actions = {20: SURE, 30: (5, 0, 0, 0, 0), 40: (5, 5, 0, 0, 0)}
    reproduce_task._test(job, Place(tmp_path, tmp_path), lambda _: None)

    *_, asked = benchmark.asked
    assert (asked.split, asked.rooms) == ("test", rooms_of("bathroom", "test"))
    assert (asked.episodes, asked.seeds) == (TINY.test_episodes, tuple(range(TINY.trials)))
    assert asked.agent == Played(20, replace(job.training.config, **row.tested_with), TEMPERATURE)
    assert (asked.agent.config.merge_order, job.training.config.merge_order) == (4, RunConfig().merge_order)

    outcome = Outcome.load(job.result(tmp_path))
    assert outcome.rooms == tuple(map(str, rooms_of("bathroom", "test")))
    assert outcome.success.tolist() == [[True] * 5] * TINY.trials
    facts = outcome.facts
    assert (facts["frames"], facts["choice"]["checkpoint"]) == (2000, "0001-000000020.safetensors")
    assert (facts["tested_with"], facts["config"]["merge_order"]) == (row.tested_with, 4)


def test_random_is_tested_on_the_same_rooms_as_often(tmp_path: Path, benchmark: Benchmarks) -> None:
    (job,) = jobs_of(TABLE, TABLE.rows[0], TINY)
    reproduce_task._test(job, Place(tmp_path, tmp_path), lambda _: None)
    (asked,) = benchmark.asked
    assert isinstance(asked.agent, RandomAgent)
    assert (asked.split, asked.rooms) == ("test", rooms_of("bathroom", "test"))
    assert (asked.episodes, asked.seeds) == (TINY.test_episodes, tuple(range(TINY.trials)))
    assert Outcome.load(job.result(tmp_path)).success.shape == (TINY.trials, 5)
