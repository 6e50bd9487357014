import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pytest

from hoz_dist.cli.main import run
from hoz_dist.nav.categories import SCENE_TARGETS

pytestmark = pytest.mark.integration


def test_list_says_which_rooms_and_targets_each_scene_has(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["scenes", "list", "--json"]) == 0
    scenes = {facts["scene"]: facts for facts in json.loads(capsys.readouterr().out)["scenes"]}
    assert scenes["kitchen"]["splits"] == {"train": [1, 20], "val": [21, 25], "test": [26, 30]}
    assert scenes["apartment"]["splits"] == {"train": [1, 60], "val": [61, 65], "test": [66, 75]}
    assert scenes["apartment"]["targets"] == list(SCENE_TARGETS["apartment"])

    assert run(["scenes", "list"]) == 0
    text = capsys.readouterr().out
    assert "apartment: rooms 1-60 to train in, 61-65 for validation, 66-75 for the test; 12 targets\n" in text


def test_show_says_what_is_in_a_room(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["scenes", "show", "bathroom/1", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["room"] == "bathroom/1"
    assert facts["split"] == "train"
    assert facts["views"] == facts["positions"] * 16
    assert facts["targets"]
    assert set(facts["targets"]) <= set(SCENE_TARGETS["bathroom"])
    assert set(facts["targets"]) <= set(facts["items"])

    assert run(["scenes", "show", "bathroom/1"]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"bathroom/1 (train): {facts['width']:.2f} m x {facts['depth']:.2f} m\n")
    assert facts["digest"] in text


def test_render_fills_the_cache_and_draws_a_contact_sheet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cache, sheet = tmp_path / "views", tmp_path / "sheet.png"
    command = ["scenes", "render", "bathroom/14", "bathroom/9", "--picture-size", "24", "--cache", str(cache)]
    assert run([*command, "--jobs", "2", "--output", str(sheet)]) == 0
    first = capsys.readouterr()
    assert f"The cache {cache} holds all" in first.out
    assert "views of 2 rooms." in first.out
    assert "100%" in first.err
    assert matplotlib.image.imread(sheet).shape[:2] == (2 * (24 + 2), 8 * (24 + 2))

    # The picture is not replaced unasked; what is in the cache is kept.
    assert run([*command, "--output", str(sheet)]) == 2
    assert str(sheet) in capsys.readouterr().err
    before = {file: file.stat().st_mtime_ns for file in cache.rglob("*.npy")}
    assert run(command) == 0
    assert {file: file.stat().st_mtime_ns for file in cache.rglob("*.npy")} == before


def test_render_says_in_one_sentence_that_the_cache_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("not a folder")
    command = ["scenes", "render", "bathroom/1", "--picture-size", "24", "--cache", str(tmp_path / "file" / "views")]
    assert run(command) == 2
    assert "cannot be written" in capsys.readouterr().err.splitlines()[-1]


def test_ctrl_c_ends_rendering_at_once_and_quietly(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hoz_dist.cli.main", "scenes", "render", "kitchen", "--cache", str(tmp_path)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        assert process.stderr is not None
        said: list[str] = []
        while not said or not said[-1].startswith("Rendering"):
            said.append(process.stderr.readline())
            assert said[-1], "it ended by itself"
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: every process of the command gets it
        said += process.stderr.readlines()
    assert process.returncode == 130
    assert not [line for line in said if "Traceback" in line]
