import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

from hoz_dist.cli.main import EXIT_USER_ERROR, run
from hoz_dist.cli.reproducing.outcomes import read_outcomes
from hoz_dist.cli.reproducing.results import Results
from hoz_dist.errors import InvalidValueError
from hoz_dist.reproduce.budget import BUDGETS
from hoz_dist.reproduce.job import Job, jobs_of
from hoz_dist.reproduce.tables import TABLES
from tests.unit.reproduce.making import TABLE, TINY, outcome_of


def test_without_a_table_all_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["reproduce"]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in TABLES)
    assert "10 rows, 11 trainings of 2M frames" in said  # of eight agents, three of them with two seeds
    assert "21 rows, 2 trainings of 2M frames" in said  # the rows of merge-order share those of hoz
    assert "--estimate" in said
    assert run(["reproduce", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["methods"]["rows"][-1] == "oracle"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["tabel"], "table"),
        (["--collect"], "--collect is about one table; name it"),
        (["--row", "hoz"], "--row is about one table"),
        (["methods", "--seeds", "some"], "'some' is neither a number of seeds nor FIRST-LAST"),
        (["methods", "--seeds", "0"], "'0' is no range of seeds from 0 to 99"),
        (["methods", "--seeds", "9-5"], "give FIRST before LAST"),
        (["--seeds", "5"], "--seeds is about one table"),
        (["methods", "--seeds", "5-100"], "'5-100' is no range of seeds from 0 to 99"),
        (["methods", "--seeds", "9" * 5000], "is neither a number of seeds"),
        (["--jobs", "2"], "--jobs is about one table"),
        (["--out", "runs"], "--out is about one table"),
        (["methods", "--collect", "--jobs", "2"], "--collect runs nothing, so --jobs"),
        (["methods", "--runs", "--jobs", "2"], "--runs runs nothing, so --jobs"),
        (["methods", "--budget", "none"], "budget"),
        (["methods", "--row", "hoz2"], "row"),
        (["methods", "--row", "hoz", "--collect"], "--collect shows all rows, so --row"),
        (["methods", "--estimate", "--collect"], "--estimate and --collect are two things"),
        (["methods", "--estimate", "--docs", "docs"], "--estimate makes no files"),
        (["methods", "--runs", "--estimate"], "--estimate and --runs are two"),
        (["methods", "--runs", "--collect"], "--collect and --runs are two"),
        (["methods", "--runs", "--docs", "docs"], "--runs makes no files, so --docs"),
        (["methods", "--runs", "--out", "none"], "'none' has no finished run of these rows"),
    ],
)
def test_what_does_not_exist_is_said(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["reproduce", *words]) == EXIT_USER_ERROR
    assert sentence in capsys.readouterr().err


def test_help_says_what_a_budget_gives(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["reproduce", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "quick: 2M frames in rooms, 3M in apartments, 1-2 seeds;" in said
    # The help is made when the command is first imported, and a test before may have added a budget of its own.
    assert re.search(r"full: 16M frames in rooms, 24M in apartments, 5 seeds[.;]", said)


def test_a_table_without_results_is_not_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, docs = tmp_path / "typo", tmp_path / "docs"
    docs.mkdir()
    (docs / "edge-cost-quick.md").write_text("published")
    words = ["reproduce", "edge-cost", "--collect", "--out", str(out), "--docs", str(docs)]
    assert run(words) == EXIT_USER_ERROR
    assert f"'{out}' has no results of 'edge-cost-quick'" in capsys.readouterr().err
    assert [path.read_text() for path in docs.iterdir()] == ["published"]


def test_published_results_are_not_replaced_by_fewer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["reproduce", "zones", "--collect", "--docs", str(tmp_path / "docs"), "--out"]
    save_outcomes("zones", "quick", range(2), tmp_path / "whole")
    save_outcomes("zones", "quick", range(1), tmp_path / "part")
    assert run([*words, str(tmp_path / "whole")]) == 0
    published = {path: path.read_bytes() for path in (tmp_path / "docs").iterdir()}
    assert run([*words, str(tmp_path / "part")]) == EXIT_USER_ERROR
    lost = "has 2 results, and what would replace it lacks that of 'hoz' with seed 1;"
    assert lost in capsys.readouterr().err
    assert {path: path.read_bytes() for path in (tmp_path / "docs").iterdir()} == published
    assert (tmp_path / "part" / "zones-quick.md").exists()
    assert run([*words, str(tmp_path / "whole")]) == 0

    # Nor are those of the folder itself, by the command that makes them again, nor by as many results of other rows.
    hoz, other = (job for name in ("hoz", "K = 2") for job in zones_jobs(name)[:1])
    hoz.result(tmp_path / "whole").unlink()
    outcome_of(other).save(other.result(tmp_path / "whole"))
    capsys.readouterr()
    assert run(["reproduce", "zones", "--collect", "--out", str(tmp_path / "whole")]) == EXIT_USER_ERROR
    assert "lacks that of 'hoz' with seed 0;" in capsys.readouterr().err
    assert (tmp_path / "whole" / "zones-quick.json").read_bytes() == published[tmp_path / "docs" / "zones-quick.json"]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"agent": "object"}, "it is of the agent 'object'"),
        ({"config": {}}, "it is of another configuration"),
        ({"choice": None}, "it lacks choice.seconds"),
        ({"choice": {}}, "it lacks choice.seconds"),
        ({"test_seconds": None}, "it lacks test_seconds"),
    ],
)
def test_results_of_something_else_are_refused_before_anything_is_trained(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: dict[str, Any], sentence: str
) -> None:
    job = zones_jobs("hoz")[1]
    outcome = outcome_of(job)
    replace(outcome, facts={**outcome.facts, **change}).save(job.result(tmp_path))
    for more in (["--collect"], []):
        assert run(["reproduce", "zones", "--out", str(tmp_path), *more]) == EXIT_USER_ERROR
        said = capsys.readouterr().err
        assert f"'{job.result(tmp_path)}' is not of 'hoz' with seed 1 ({sentence}); delete it" in said
        assert said.count("\n") == 1


def test_one_file_is_not_counted_twice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second = zones_jobs("hoz")
    outcome_of(first).save(first.result(tmp_path))
    shutil.copy(first.result(tmp_path), second.result(tmp_path))
    assert run(["reproduce", "zones", "--collect", "--out", str(tmp_path)]) == EXIT_USER_ERROR
    assert f"'{second.result(tmp_path)}' is not of 'hoz' with seed 1" in capsys.readouterr().err


def test_two_trainings_are_not_compared_as_one_agent(tmp_path: Path) -> None:
    jobs = {row.name: jobs_of(TABLE, row, TINY) for row in TABLE.rows}
    hoz, other = jobs["hoz"][0], jobs["other order"][0]
    outcome_of(hoz).save(hoz.result(tmp_path))
    outcome_of(other, seconds=61.0).save(other.result(tmp_path))
    with pytest.raises(InvalidValueError, match="are of two trainings of it") as error:
        read_outcomes(jobs, tmp_path)
    assert all(str(job.result(tmp_path)) in str(error.value) for job in (hoz, other))


def test_an_agent_whose_run_is_gone_is_not_trained_anew_for_one_more_test(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = TABLES["merge-order"].rows
    job = jobs_of(TABLES["merge-order"], rows[-1], BUDGETS["quick"])[0]
    outcome_of(job).save(job.result(tmp_path))
    words = ["reproduce", "merge-order", "--out", str(tmp_path), "--row", rows[0].name, "--row", rows[-1].name]
    assert run(words) == EXIT_USER_ERROR
    said = capsys.readouterr().err
    assert f"'{job.result(tmp_path)}' is there, but not the run that it is of, so '{rows[0].name}' would be" in said
    assert run(["reproduce", "merge-order", "--runs", "--out", str(tmp_path)]) == EXIT_USER_ERROR
    assert "has results of these rows, but not their runs; train them in another --out" in capsys.readouterr().err


def test_runs_that_are_trained_and_tested_are_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = {row.name: jobs_of(TABLES["methods"], row, BUDGETS["quick"]) for row in TABLES["methods"].rows}
    for job in (*rows["object"], *rows["hoz"]):
        assert job.training is not None
        job.training.folder(tmp_path).mkdir(parents=True)
    tested = [rows["random"][0], rows["object"][0], *rows["hoz"]]
    for job in tested:
        outcome_of(job).save(job.result(tmp_path))
    folders = [str(job.training.folder(tmp_path)) for job in tested if job.training is not None]

    assert run(["reproduce", "methods", "--runs", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines() == folders
    assert run(["reproduce", "methods", "--runs", "--row", "hoz", "--out", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == folders[1:]


def test_results_are_read_written_and_counted_once(tmp_path: Path) -> None:
    jobs = {row.name: jobs_of(TABLE, row, TINY) for row in TABLE.rows}
    for seed, job in enumerate(jobs["hoz"][:2]):
        outcome_of(job).save(job.result(tmp_path))
        outcome_of(jobs["other order"][seed], skill=0.5).save(jobs["other order"][seed].result(tmp_path))
    results = Results.read(TABLE, TINY, "hoz-dist reproduce some", jobs, tmp_path)
    assert {name: list(by_seed) for name, by_seed in results.outcomes.items()} == {
        "random": [],
        "object": [],
        "other order": [0, 1],
        "hoz": [0, 1],
    }
    paths = results.write(tmp_path / "docs", [{"estimated_seconds": 3.0, "took_seconds": 3.5}])
    assert [path.name for path in paths] == ["some-tiny.md", "some-tiny.json", "some-tiny.png"]
    written = json.loads(paths[1].read_text())
    assert written["unfinished"]["hoz"] == {"finished": 2, "wanted": 3}
    assert written["unfinished"]["object"] == {"finished": 0, "wanted": 1}
    assert "object 0 of 1 seeds" in paths[0].read_text()
    assert written["sessions"] == [{"estimated_seconds": 3.0, "took_seconds": 3.5}]
    assert written["rows"]["hoz"]["runs"]["1"]["training_seconds"] == 60.0
    assert written["rows"]["hoz"]["seeds"] == [0, 1]
    for seed, job in enumerate(jobs["hoz"][:2]):
        assert tmp_path / written["rows"]["hoz"]["runs"][str(seed)]["file"] == job.result(tmp_path)
    # Two trainings and choices, which two rows share, and two tests of each row.
    assert results.hours == pytest.approx((2 * (60 + 1) + 4 * 3) / 3600)
    folder = jobs["other order"][0].result(tmp_path).parent.relative_to(tmp_path)
    assert f"other order `{folder}`" in paths[0].read_text()


@pytest.mark.parametrize(
    ("words", "stem", "own"),
    [
        (["--budget", "full"], "zones-full", [1]),
        (["--seeds", "3"], "zones-quick-seeds-3", [3]),
        (["--seeds", "4"], "zones-quick-seeds-4", [4]),
        ([], "zones-quick", [0]),
    ],
)
def test_a_table_shows_its_own_sessions(tmp_path: Path, words: list[str], stem: str, own: list[int]) -> None:
    sessions = [
        {"table": "zones", "budget": "quick", "took_seconds": None},  # from before --seeds was noted
        {"table": "zones", "budget": "full", "took_seconds": 1.0, "seeds": None, "rows": ["hoz"]},
        {"table": "methods", "budget": "quick", "took_seconds": 2.0},
        {"table": "zones", "budget": "quick", "took_seconds": 3.0, "seeds": 3, "rows": []},  # from before 5-14 was
        {"table": "zones", "budget": "quick", "took_seconds": 4.0, "seeds": "4", "rows": []},
    ]
    (tmp_path / "sessions.json").write_text(json.dumps(sessions))
    save_outcomes("zones", words[1] if "--budget" in words else "quick", range(1), tmp_path)
    assert run(["reproduce", "zones", *words, "--collect", "--out", str(tmp_path)]) == 0
    shown = json.loads((tmp_path / f"{stem}.json").read_text())["sessions"]
    assert shown == [sessions[number] for number in own]


@pytest.mark.parametrize(
    ("seeds", "stem", "shown"),
    [
        ("2", "methods-full-seeds-2", [0, 1]),
        ("5", "methods-full", [0, 1, 2, 3]),
        ("0-4", "methods-full", [0, 1, 2, 3]),
        ("2-9", "methods-full-seeds-2-9", [2, 3]),
    ],
)
def test_a_table_of_other_seeds_does_not_overwrite_the_whole_one(
    tmp_path: Path, seeds: str, stem: str, shown: list[int]
) -> None:
    save_outcomes("methods", "full", range(4), tmp_path / "all")
    words = ["--out", str(tmp_path / "all"), "--docs", str(tmp_path / "docs"), "--seeds", seeds]
    assert run(["reproduce", "methods", "--budget", "full", "--collect", *words]) == 0
    assert {path.name for path in (tmp_path / "docs").iterdir()} == {
        f"{stem}.{suffix}" for suffix in ("md", "json", "png")
    }
    assert json.loads((tmp_path / "docs" / f"{stem}.json").read_text())["rows"]["hoz"]["seeds"] == shown


def test_a_second_command_on_one_folder_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with FileLock(tmp_path / "reproduce.lock"):
        assert run(["reproduce", "methods", "--out", str(tmp_path)]) == EXIT_USER_ERROR
    said = capsys.readouterr().err
    assert said.startswith(f"hoz-dist: Another hoz-dist reproduce works in '{tmp_path}'")
    assert said.count("\n") == 1


def test_files_for_the_documentation_are_those_of_the_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_outcomes("methods", "quick", range(2), tmp_path / "out")
    words = ["--out", str(tmp_path / "out"), "--docs", str(tmp_path / "docs" / "new")]
    assert run(["reproduce", "methods", "--collect", *words, "--json"]) == 0
    err = capsys.readouterr().err

    names = [f"methods-quick.{suffix}" for suffix in ("md", "json", "png")]
    for name in names:
        assert (tmp_path / "docs" / "new" / name).read_bytes() == (tmp_path / "out" / name).read_bytes()
    folders = (tmp_path / "out", tmp_path / "docs" / "new")
    assert err == f"Written: {', '.join(str(folder / name) for folder in folders for name in names)}\n"


def zones_jobs(name: str) -> Sequence[Job]:
    """The jobs of a row of the table `zones` at `quick`."""
    row = next(row for row in TABLES["zones"].rows if row.name == name)
    return jobs_of(TABLES["zones"], row, BUDGETS["quick"])


def save_outcomes(table: str, budget: str, seeds: range, out: Path) -> None:
    """Have runs of `hoz` finished."""
    row = next(row for row in TABLES[table].rows if row.name == "hoz")
    for job in jobs_of(TABLES[table], row, BUDGETS[budget], seeds):
        outcome_of(job).save(job.result(out))
