"""The command with everything but its processes, which have ended as tests want it."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.main import EXIT_FAILED, EXIT_USER_ERROR, run
from hoz_dist.cli.processes import MOST_RESTARTS
from hoz_dist.cli.reproducing import costs as reproduce_costs
from hoz_dist.cli.reproducing import crew as reproduce_crew
from hoz_dist.cli.reproducing.sessions import read_sessions
from hoz_dist.reproduce.budget import BUDGETS
from hoz_dist.reproduce.costs import Costs, Speed
from hoz_dist.reproduce.job import Task
from hoz_dist.reproduce.tables import TABLES
from tests.unit.cli.reproducing.workers import Worked
from tests.unit.reproduce.making import TABLE, TINY, make_outcome

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
    monkeypatch.setattr(reproduce_costs, "measure_costs", costs)
    monkeypatch.setattr(reproduce_costs, "missing_rooms", lambda *_: [])
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


def test_a_process_that_is_killed_is_started_again(tmp_path: Path, command: Callable[..., int]) -> None:
    started: list[Task] = []

    def start(task: Task) -> Worked:
        started.append(task)
        if started.count(task) <= MOST_RESTARTS:
            return Worked(-9)
        for job in task.jobs:
            make_outcome(job.seed).save(job.result(tmp_path))
        return Worked(0)

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


@pytest.mark.parametrize(
    ("ended", "status", "said", "starts"),
    [
        (
            -9,
            EXIT_USER_ERROR,
            "was killed again and again, perhaps for want of memory; use fewer --jobs.",
            MOST_RESTARTS + 1,
        ),
        (1, EXIT_FAILED, "failed by a mistake of ours; what it says is above.", 1),
    ],
)
def test_a_process_that_fails_or_is_killed_too_often_ends_the_command_in_one_sentence(
    tmp_path: Path,
    command: Callable[..., int],
    capsys: pytest.CaptureFixture[str],
    ended: int,
    status: int,
    said: str,
    starts: int,
) -> None:
    started: list[Worked] = []

    def start(_: Task) -> Worked:
        started.append(Worked(ended))
        return started[-1]

    assert command(start, "--row", "object", "--seeds", "1") == status
    assert len(started) == starts
    assert capsys.readouterr().err.splitlines()[-1] == f"hoz-dist: A process of this command {said}"
    (session,) = read_sessions(tmp_path)
    assert (session["seeds"], session["rows"], session["finished"]) == (1, ["object"], False)
