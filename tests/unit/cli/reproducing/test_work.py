"""The command with everything but its processes, which have ended as tests want it."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli import rendering
from hoz_dist.cli.main import EXIT_FAILED, EXIT_USER_ERROR, run
from hoz_dist.cli.processes import MOST_RESTARTS
from hoz_dist.cli.reproducing import crew as reproduce_crew
from hoz_dist.cli.reproducing import work as reproduce_work
from hoz_dist.cli.reproducing.sessions import read_sessions
from hoz_dist.cli.reproducing.task import Place, perform
from hoz_dist.cli.reproducing.worker import Failure
from hoz_dist.errors import HozError
from hoz_dist.nav.rooms import RoomId
from hoz_dist.reproduce.budget import BUDGETS
from hoz_dist.reproduce.costs import Costs, Speed
from hoz_dist.reproduce.job import Task, jobs_of
from hoz_dist.reproduce.tables import TABLES
from learner.checkpoint import FOLDER
from tests.unit.cli.reproducing.workers import Worked
from tests.unit.reproduce.making import TABLE, TINY, outcome_of

Start = Callable[[Task], Worked]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Runs the tiny table in a folder whose processes a function makes."""

    def started(start: Start, *options: str) -> int:
        monkeypatch.setattr(reproduce_crew, "Worker", lambda _, __, task, ___: start(task))
        words = ["reproduce", "some", "--budget", "tiny", "--jobs", "2", "--out", str(tmp_path), *options]
        return run(words)

    def costs(tasks: list[Task], *_: object) -> Costs:
        return Costs({task.training.digest: Speed(100.0, 0.001) for task in tasks if task.training is not None})

    monkeypatch.setitem(TABLES, "some", TABLE)
    monkeypatch.setitem(BUDGETS, "tiny", TINY)
    monkeypatch.setattr(reproduce_work, "measure_costs", costs)
    monkeypatch.setattr(rendering, "missing_rooms", lambda *_: [])
    monkeypatch.setattr(reproduce_crew, "wait", lambda *_: [])
    return started


def test_an_estimate_trains_nothing(
    tmp_path: Path, command: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    def start(task: Task) -> Worked:
        pytest.fail(f"started {task}")

    assert command(start, "--estimate", "--json") == 0
    estimate: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert estimate["runs"] == 5
    assert estimate["seconds"] > 10
    assert command(start, "--estimate") == 0
    assert capsys.readouterr().out.startswith("Agents left: 5, of which 4 learn; with 2 at once it takes about ")
    assert [path.name for path in tmp_path.iterdir()] == ["reproduce.lock"]


def test_as_many_processes_render_as_will_work(
    tmp_path: Path, command: Callable[..., int], monkeypatch: pytest.MonkeyPatch
) -> None:
    rendered: list[tuple[list[RoomId], int]] = []
    monkeypatch.setattr(rendering, "missing_rooms", lambda rooms, *_: rooms[:5])
    monkeypatch.setattr(rendering, "render_rooms", lambda rooms, _, __, jobs, ___: rendered.append((rooms, jobs)))
    assert command(lambda task: finished(task, tmp_path)) == 0
    ((rooms, jobs),) = rendered
    assert (len(rooms), jobs) == (5, 2)


def test_a_process_that_is_killed_is_started_again(tmp_path: Path, command: Callable[..., int]) -> None:
    started: list[Task] = []

    def start(task: Task) -> Worked:
        started.append(task)
        if started.count(task) <= MOST_RESTARTS:
            return Worked(-9)
        return finished(task, tmp_path)

    assert command(start) == 0
    assert len(started) == 5 * (MOST_RESTARTS + 1)
    results = json.loads((tmp_path / "some-tiny.json").read_text())
    assert results["unfinished"] == {}
    (session,) = results["sessions"]
    assert {name: session[name] for name in ("table", "budget", "seeds", "rows", "runs", "finished")} == {
        "table": "some",
        "budget": "tiny",
        "seeds": None,
        "rows": [],
        "runs": 5,
        "finished": True,
    }


def test_a_task_that_fails_is_tried_once_more(
    tmp_path: Path, command: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    started: list[str] = []

    def start(task: Task) -> Worked:
        started.append(task.name)
        if started.count(task.name) == 1:
            return Worked(1, [Failure("The learner did not answer.")])
        return finished(task, tmp_path)

    assert command(start) == 0
    assert len(started) == 10
    said = capsys.readouterr().err
    assert "object, seed 0 failed, and is started once more: The learner did not answer." in said.splitlines()
    assert json.loads((tmp_path / "some-tiny.json").read_text())["unfinished"] == {}


@pytest.mark.parametrize(
    ("status", "sent", "starts", "sentence"),
    [
        (1, [Failure("The port is taken.")], 2, "The port is taken."),
        (
            -9,
            [],
            MOST_RESTARTS + 1,
            "Its process was killed again and again, perhaps for want of memory; use fewer --jobs.",
        ),
    ],
)
def test_a_task_that_fails_again_keeps_no_other_from_being_done(
    tmp_path: Path,
    command: Callable[..., int],
    capsys: pytest.CaptureFixture[str],
    status: int,
    sent: list[Failure],
    starts: int,
    sentence: str,
) -> None:
    started: list[str] = []

    def start(task: Task) -> Worked:
        started.append(task.name)
        if task.name in {"object, seed 0", "other order, seed 1"}:
            return Worked(status, sent)
        return finished(task, tmp_path)

    assert command(start) == EXIT_USER_ERROR
    assert len(started) == 3 + 2 * starts
    said = capsys.readouterr().err.splitlines()
    assert said[-1] == (
        f"hoz-dist: 2 of 5 agents failed, and the same command tries again; first 'object, seed 0': {sentence}"
    )
    # Each one's reason is there to be read, when it fails and in the morning.
    for name in ("object, seed 0", "other order, seed 1"):
        assert [line for line in said if line.startswith(f"{name} ") and line.endswith(f"this command: {sentence}")]
    assert "3 of 5 agents, 2 failed" in said[-2]
    assert read_sessions(tmp_path)[-1]["finished"] is False

    again: list[Task] = []

    def start_again(task: Task) -> Worked:
        again.append(task)
        return finished(task, tmp_path)

    assert command(start_again) == 0
    assert [task.name for task in again] == ["object, seed 0", "other order, seed 1"]


def test_a_damaged_run_keeps_no_other_from_being_done(
    tmp_path: Path, command: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    job = jobs_of(TABLE, TABLE.rows[1], TINY)[0]
    assert job.training is not None
    run_folder = job.training.folder(tmp_path)
    (run_folder / FOLDER).mkdir(parents=True)
    (run_folder / FOLDER / "0001-000000020.safetensors").write_bytes(b"junk")
    done: list[str] = []

    def start(task: Task) -> Worked:
        try:
            if task.training == job.training:
                perform(task, Place(tmp_path, tmp_path), lambda _: None)
        except HozError as error:
            return Worked(1, [Failure(str(error))])
        done.append(task.name)
        return finished(task, tmp_path)

    assert command(start) == EXIT_USER_ERROR
    assert len(done) == 4
    assert capsys.readouterr().err.endswith(f"Delete the folder '{run_folder}' to have it trained anew.\n")


def test_a_mistake_of_ours_ends_the_command_at_once(
    tmp_path: Path, command: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    started: list[Task] = []

    def start(task: Task) -> Worked:
        started.append(task)
        return Worked(1)

    assert command(start, "--row", "object", "--row", "hoz", "--seeds", "2") == EXIT_FAILED
    assert len(started) == 2
    assert capsys.readouterr().err.splitlines()[-1] == (
        "hoz-dist: object, seed 0: A process of this command failed by a mistake of ours; what it says is above."
    )
    (session,) = read_sessions(tmp_path)
    assert (session["seeds"], session["rows"], session["finished"]) == ("2", ["object", "hoz"], False)


def finished(task: Task, out: Path) -> Worked:
    """A process that has done its task."""
    for job in task.jobs:
        outcome_of(job).save(job.result(out))
    return Worked(0)
