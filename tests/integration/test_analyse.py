"""`hoz-dist analyse` on real validation rooms."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from hoz_dist import __version__
from hoz_dist.cli.analysing import tracing
from hoz_dist.cli.main import run
from hoz_dist.config import RunConfig
from hoz_dist.errors import InvalidValueError
from hoz_dist.evaluation.protocol import EPISODE_SEED, TEMPERATURE
from hoz_dist.viz import analysis
from learner.checkpoint import FOLDER, load_checkpoint, save_checkpoint
from tests.integration.learning import graph_of
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
        ("object-0", RunConfig(method="object", gradient_norm=0.5)),
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
    assert (results["version"], results["split"]) == (__version__, "val")
    assert results["parameters"] == {
        "scenes": ["bathroom"],
        "episodes_per_scene": EPISODES,
        "episode_seed": EPISODE_SEED,
        "trials": 1,
        "seeds": [0],
        "temperature": TEMPERATURE,
    }
    file, named = next((runs / "hoz-0" / FOLDER).glob("*.safetensors")).name, ("path", "method", "seed", "options")
    assert {"checkpoint": file, "version": 0, "frames": 0}.items() <= results["runs"][0].items()
    assert [tuple(of_run[name] for name in named) for of_run in results["runs"]] == [
        (str(paths[0]), "hoz", 0, {}),
        (str(paths[1]), "object", 0, {"gradient_norm": 0.5}),
        (str(paths[2]), "hoz", 1, {}),
    ]
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


def test_curves_have_the_same_trials_as_the_runs(runs: Path, cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept = runs / "object-0" / FOLDER
    words = ["analyse", str(kept), "--episodes", "60", "--cache", str(cache), "--curve", "--json"]
    assert run([*words, "--seed", "3", "--trials", "2"]) == 0
    results: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert results["parameters"]["seeds"] == [3, 4]
    # The only checkpoint that the run keeps is its newest one.
    ((curve,),) = results["curves"].values()
    assert curve["success"] == [pytest.approx(results["methods"]["object"]["all"]["causes"]["success"])]
    assert run([*words, "--seed", "0", "--trials", "1"]) == 0
    assert json.loads(capsys.readouterr().out)["curves"]["object"] != [curve]


def test_a_users_mistake_is_one_sentence(
    runs: Path, cache: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    unkept = save_run(tmp_path / "unkept", RunConfig())
    hoz = runs / "hoz-0"
    file = next((hoz / FOLDER).glob("*.safetensors"))
    for words, said in (
        ([*words_for(cache, unkept), "--curve"], f"'{unkept}' keeps no checkpoint for a curve; give a run folder"),
        (words_for(cache, runs / "none"), "There is no checkpoint"),
        ([*words_for(cache, file), "--curve"], f"--curve needs run folders, and '{file}' is a file;"),
        (words_for(cache, hoz, runs / "hoz-1", hoz), f"'{hoz}' and '{hoz}' are the same checkpoint; name it once."),
        (words_for(cache, hoz, file), f"'{hoz}' and '{file}' are the same checkpoint; name it once."),
        (["analyse"], "Missing argument 'RUN...'."),
        ([*words_for(cache, runs / "object-0"), "--curve", "--split", "test"], "--curve compares checkpoints, which"),
    ):
        refused(words, said, capfd)


def test_what_stands_against_a_result_is_said_before_any_episode(
    runs: Path, cache: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tracing, "trace_runs", lambda *_: pytest.fail("episodes are run"))
    (tmp_path / "file").touch()
    (tmp_path / "taken" / "failures.png").mkdir(parents=True)
    damaged = Path(shutil.copytree(runs / "object-0", tmp_path / "damaged"))
    file = next((damaged / FOLDER).glob("*.safetensors"))
    older = file.with_name("0000-000000000.safetensors")
    older.write_bytes(file.read_bytes()[:-1])
    older.with_suffix(".keep").touch()
    file.rename(newer := file.with_name("0001-000000001.safetensors"))
    newer.with_suffix(".keep").touch()
    good = words_for(cache, runs / "hoz-0")
    for words, said in (
        ([*good, "--out", str(tmp_path / "file" / "new")], f"Nothing can be written to '{tmp_path}/file/new' (Not a"),
        ([*good, "--out", "/proc"], "Nothing can be written to '/proc' ("),  # not even by root
        ([*good, "--out", str(tmp_path / "taken")], f"'{tmp_path}/taken/failures.png' is a folder; name a file"),
        ([*words_for(cache, damaged), "--curve"], f"--curve needs '{older}', which is damaged; leave out --curve, or"),
    ):
        refused(words, said, capfd)


def test_a_picture_that_fails_costs_no_figure(
    runs: Path, cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full_disk(*_: object) -> None:
        message = "The disk is full."
        raise InvalidValueError(message)

    monkeypatch.setattr(analysis, "failure_figure", full_disk)
    assert run([*words_for(cache, runs / "hoz-0"), "--out", str(tmp_path)]) == 2
    out, err = capsys.readouterr()
    assert err.endswith("hoz-dist: The disk is full.\n")
    assert "12 episodes on unseen validation rooms; runs: hoz 1;" in " ".join(out.split())
    assert "hoz" in json.loads((tmp_path / "analysis.json").read_text())["methods"]


def test_seeds_that_were_trained_in_other_rooms_are_not_pooled(
    runs: Path, cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = save_run(tmp_path / "other", RunConfig(seed=2))
    elsewhere = replace(load_checkpoint(other), rooms=(graph_of("bathroom/2", zones=RunConfig().zones),))
    save_checkpoint(other / FOLDER, elsewhere)
    paths = [runs / "hoz-0", runs / "hoz-1", other]
    assert run([*words_for(cache, *paths), "--json"]) == 0
    results: dict[str, Any] = json.loads(capsys.readouterr().out)
    ours, theirs = f"hoz ({paths[0]})", f"hoz ({other})"
    assert [of_run["method"] for of_run in results["runs"]] == [ours, ours, theirs]
    assert [results["methods"][name]["all"]["trials"] for name in (ours, theirs)] == [2, 1]


def refused(words: list[str], said: str, capfd: pytest.CaptureFixture[str]) -> None:
    """Run a command that ends with one sentence and nothing else."""
    assert run(words) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith(f"hoz-dist: {said}")
    assert err.count("\n") == 1
