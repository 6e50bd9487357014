"""`hoz-dist evaluate` on real validation rooms."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.main import run
from hoz_dist.config import RunConfig
from tests.integration.commands import hoz_dist
from tests.integration.runs import save_run

pytestmark = pytest.mark.integration

EPISODES = 20


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that has not learned anything yet."""
    return save_run(tmp_path_factory.mktemp("run"), RunConfig())


def words_for(checkpoint: Path, cache: Path, seed: int) -> list[str]:
    words = ["evaluate", str(checkpoint), "--trials", "2", "--seed", str(seed), "--episodes", str(EPISODES)]
    return [*words, "--cache", str(cache), "--json"]


@pytest.fixture
def evaluated(run_folder: Path, cache: Path, capsys: pytest.CaptureFixture[str]) -> Callable[[int], dict[str, Any]]:
    """Evaluate in this process, with a seed."""

    def evaluate(seed: int) -> dict[str, Any]:
        assert run(words_for(run_folder, cache, seed)) == 0
        result: dict[str, Any] = json.loads(capsys.readouterr().out)
        return result

    return evaluate


def test_the_same_seed_prints_the_same_and_another_one_or_temperature_something_else(
    evaluated: Callable[[int], dict[str, Any]], run_folder: Path, cache: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = evaluated(0)
    assert (result["method"], result["split"], result["episodes"]) == ("hoz", "val", EPISODES)
    for part in (result["all"], result["long"]):
        for figure in ("sr", "spl", "sae"):
            assert set(part[figure]) == {"mean", "std"}
            assert 0 <= part[figure]["mean"] <= 100
    assert result["baselines"]["oracle"]["all"]["sr"] == {"mean": 100.0, "std": 0.0}
    assert result["baselines"]["oracle"]["all"]["spl"]["mean"] == 100.0

    again = hoz_dist(*words_for(run_folder, cache, 0))
    assert again.stdout == json.dumps(result, indent=2) + "\n"
    assert run([*words_for(run_folder, cache, 0), "--temperature", "0.01"]) == 0
    likeliest = json.loads(capsys.readouterr().out)
    assert likeliest["all"] != result["all"], "the likeliest actions do otherwise than drawn ones"
    assert likeliest["baselines"] == result["baselines"]
    other = evaluated(7)
    assert other["all"] != result["all"]
    assert other["baselines"]["random"]["all"] != result["baselines"]["random"]["all"]
    assert other["baselines"]["oracle"] == result["baselines"]["oracle"]  # the episodes are the same


def test_damaged_views_are_rendered_again(
    evaluated: Callable[[int], dict[str, Any]],
    run_folder: Path,
    cache: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    expected = evaluated(0)
    for room in cache.glob("bathroom-2[1-5]-*"):
        (tmp_path / room.name).symlink_to(room)
    hurt = next(tmp_path.glob("bathroom-21-*"))
    hurt.unlink()
    shutil.copytree(next(cache.glob(hurt.name)), hurt)
    for file in hurt.iterdir():
        with file.open("r+b") as content:
            content.truncate(file.stat().st_size // 2)
    assert run(words_for(run_folder, tmp_path, 0)) == 0
    assert json.loads(capsys.readouterr().out) == expected


def flipped(whole: bytes) -> bytes:
    middle = len(whole) // 2
    return whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]


def cut(whole: bytes) -> bytes:
    return whole[: len(whole) // 2]


def emptied(whole: bytes) -> bytes:
    return whole[:0]


def replaced(whole: bytes) -> bytes:
    return whole[:0] + b"my notes"


@pytest.mark.parametrize("damage", [flipped, cut, emptied, replaced])
def test_a_damaged_checkpoint_is_one_sentence(
    damage: Callable[[bytes], bytes], run_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = next((run_folder / "checkpoints").iterdir())
    file = tmp_path / whole.name
    file.write_bytes(damage(whole.read_bytes()))
    before = file.read_bytes()
    assert run(["evaluate", str(file)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"hoz-dist: '{file}' is damaged or not a checkpoint")
    assert err.count("\n") == 1
    assert file.read_bytes() == before


def test_a_run_that_has_only_damaged_checkpoints_is_one_sentence(run_folder: Path, tmp_path: Path) -> None:
    whole = next((run_folder / "checkpoints").iterdir())
    (tmp_path / whole.name).write_bytes(cut(whole.read_bytes()))
    result = hoz_dist("evaluate", str(tmp_path))
    assert result.returncode == 2
    assert "can be read" in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_missing_checkpoint_or_an_empty_folder_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in (tmp_path / "none.safetensors", tmp_path):
        assert run(["evaluate", str(path)]) == 2
        err = capsys.readouterr().err
        assert err.startswith("hoz-dist: There is no checkpoint")
        assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_cache_that_cannot_be_written_an_unknown_scene_or_no_temperature_is_one_sentence(
    run_folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("mine")
    for options, said in (
        (["--cache", str(tmp_path / "file" / "views")], f"The view cache {tmp_path}/file/views cannot be written"),
        (["--scene", "garage"], "Unknown scene 'garage'."),
        (["--temperature", "0"], "Invalid value for '--temperature': 0.0 is not in the range"),
    ):
        assert run(["evaluate", str(run_folder), *options]) == 2
        out, err = capfd.readouterr()
        assert out == ""
        assert err.startswith(f"hoz-dist: {said}")
        assert err.count("\n") == 1
    assert (tmp_path / "file").read_text() == "mine"
