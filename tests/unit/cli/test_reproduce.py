import json
from pathlib import Path

import pytest

from hoz_dist.cli.main import EXIT_USER_ERROR, run
from hoz_dist.cli.reproduce_results import Results
from hoz_dist.reproduce.job import jobs_of
from hoz_dist.reproduce.tables import TABLES
from tests.unit.reproduce.making import TABLE, TINY, make_outcome


def test_without_a_table_all_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["reproduce"]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in TABLES)
    assert "--estimate" in said
    assert run(["reproduce", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["methods"]["rows"][-1] == "oracle"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["tabel"], "table"),
        (["methods", "--budget", "none"], "budget"),
        (["methods", "--row", "hoz2"], "row"),
        (["methods", "--row", "hoz", "--collect"], "--collect"),
    ],
)
def test_what_does_not_exist_is_said(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["reproduce", *words]) == EXIT_USER_ERROR
    assert sentence in capsys.readouterr().err


def test_a_table_can_be_shown_before_anything_is_finished(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["reproduce", "edge-cost", "--collect", "--out", str(tmp_path)]) == 0
    assert "No results yet." in capsys.readouterr().out


def test_results_are_read_written_and_counted_once(tmp_path: Path) -> None:
    jobs = {row.name: jobs_of(TABLE, row, TINY) for row in TABLE.rows}
    for seed, job in enumerate(jobs["hoz"][:2]):
        make_outcome(seed).save(job.result(tmp_path))
        make_outcome(seed, skill=0.5).save(jobs["other order"][seed].result(tmp_path))
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
    folder = jobs["other order"][0].result(tmp_path).parent.relative_to(tmp_path)
    assert f"other order `{folder}`" in paths[0].read_text()


def test_a_table_shows_the_sessions_of_its_own_budget(tmp_path: Path) -> None:
    sessions = [
        {"table": table, "budget": budget, "took_seconds": number}
        for number, (table, budget) in enumerate([("zones", "quick"), ("zones", "full"), ("methods", "quick")])
    ]
    (tmp_path / "sessions.json").write_text(json.dumps(sessions))
    assert run(["reproduce", "zones", "--budget", "full", "--collect", "--out", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "zones-full.json").read_text())["sessions"] == [sessions[1]]


@pytest.mark.parametrize(("seeds", "stem"), [(2, "methods-full-seeds-2"), (5, "methods-full")])
def test_a_table_of_other_seeds_does_not_overwrite_the_whole_one(tmp_path: Path, seeds: int, stem: str) -> None:
    words = ["reproduce", "methods", "--budget", "full", "--collect", "--out", str(tmp_path), "--seeds", str(seeds)]
    assert run(words) == 0
    assert {path.name for path in tmp_path.iterdir()} == {f"{stem}.md", f"{stem}.json"}
