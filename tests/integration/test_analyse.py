"""`hoz-dist analyse` on real validation rooms."""

import json
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.main import run
from hoz_dist.config import RunConfig
from tests.integration.runs import save_run

pytestmark = pytest.mark.integration

EPISODES = 12


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs that have not learned anything yet: two seeds of one method, and another method."""
    folder = tmp_path_factory.mktemp("runs")
    for name, config in (
        ("hoz-0", RunConfig(seed=0)),
        ("hoz-1", RunConfig(seed=1)),
        ("object-0", RunConfig(method="object")),
    ):
        save_run(folder / name, config, keep=True)
    return folder


def words_for(cache: Path, *runs: Path) -> list[str]:
    return ["analyse", *map(str, runs), "--episodes", str(EPISODES), "--cache", str(cache)]


def test_methods_are_analysed_side_by_side_and_drawn(
    runs: Path, cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [runs / "hoz-0", runs / "object-0", runs / "hoz-1"]
    assert run([*words_for(cache, *paths), "--curve", "--json", "--out", str(tmp_path / "new")]) == 0
    results: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert results["split"] == "val"
    assert list(results["methods"]) == ["random", "hoz", "object", "oracle"]
    for name, parts in results["methods"].items():
        figures = parts["all"]
        assert figures["episodes"] == EPISODES
        assert figures["trials"] == (2 if name == "hoz" else 1)
        assert sum(figures["causes"].values()) == pytest.approx(100.0)
        budget = figures["spl_budget"]
        parts_of_spl = [budget[part] for part in ("spl", "search", "approach", "late_done")]
        assert sum(parts_of_spl) + sum(budget["failures"].values()) == pytest.approx(100.0)
        assert (figures["zones"] is not None) == (name == "hoz")
        assert parts["long"] is None or parts["long"]["episodes"] < EPISODES
    assert results["methods"]["oracle"]["all"]["spl_budget"]["spl"] == pytest.approx(100.0)
    assert {name: len(curves) for name, curves in results["curves"].items()} == {"hoz": 2, "object": 1}
    assert results["curves"]["object"][0]["frames_to"] == {"50": None, "70": None}

    pictures = {"failures.png", "success-by-length.png", "learning-curves.png", "trajectories.png"}
    assert {file.name for file in (tmp_path / "new").iterdir()} == pictures | {"analysis.json"}
    assert all((tmp_path / "new" / name).read_bytes().startswith(b"\x89PNG") for name in pictures)
    assert json.loads((tmp_path / "new" / "analysis.json").read_text()) == results


def test_the_same_figures_as_a_table(runs: Path, cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*words_for(cache, runs / "object-0"), "--long", "--trials", "2"]) == 0
    out = capsys.readouterr().out
    title = " ".join(out.split("\u250f")[0].split())  # up to the table's first corner
    assert title == (
        "12 episodes on unseen validation rooms, those with L* >= 5; runs: object 1; trials of each: 2 (seeds 0 to 1)"
    )
    assert "wrong Done: not in view" in out
    assert "L* 1-4" not in out


def test_a_users_mistake_is_one_sentence(
    runs: Path, cache: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    unkept = save_run(tmp_path / "unkept", RunConfig())
    for words, said in (
        ([*words_for(cache, unkept), "--curve"], f"'{unkept}' keeps no checkpoint for a curve; give a run folder"),
        (words_for(cache, runs / "none"), "There is no checkpoint"),
        (["analyse"], "Missing argument 'RUN...'."),
        ([*words_for(cache, runs / "object-0"), "--curve", "--split", "test"], "--curve compares checkpoints, which"),
    ):
        assert run(words) == 2
        out, err = capfd.readouterr()
        assert out == ""
        assert err.startswith(f"hoz-dist: {said}")
        assert err.count("\n") == 1
