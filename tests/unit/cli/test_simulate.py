"""`hoz-dist simulate`, as one calls it."""

import json
from pathlib import Path

import pytest

from hoz_dist.cli.main import run
from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.model import simulate
from hoz_dist.scaling.setting import Setting
from tests.unit.scaling.making import costs


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "costs.json"
    path.write_text(costs(act=1.0, apply=0.01).to_text())
    return str(path)


def test_several_numbers_of_actors_give_a_table(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["simulate", "--costs", file, "--actors", "1,2", "--actors", "3"]) == 0
    rows = [line.split("│") for line in capsys.readouterr().out.splitlines() if "│" in line]
    assert [row[2].strip() for row in rows] == ["1", "2", "3"]


def test_json_has_every_figure_of_every_number_and_all_that_it_takes_to_repeat_it(
    file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--latency", "5", "--max-lag", "1000", "--gil", "0.5", "--seed", "3", "--json"]
    assert run(["simulate", "--costs", file, "--actors", "1,2", *words]) == 0
    found = json.loads(capsys.readouterr().out)
    one, two = found["predictions"]
    assert one["frames_per_second"] == pytest.approx(100 / (1.0 + 0.01 + 4 * 0.005), rel=0.01)
    assert two["actors"] == 2
    assert {
        "lag",
        "stale",
        "busy",
        "gets_on",
        "gil_wait",
        "apply_load",
        "up_load",
        "bottleneck",
        "took_seconds",
    } <= set(two)
    assert found["seed"] == 3
    assert found["command"].startswith("hoz-dist simulate --actors 1,2")
    design = found["designs"][one["design"]]
    again = simulate(Costs(**design["costs"]), Setting(actors=2, **design["setting"]), found["seed"])
    assert again.to_json().items() <= two.items()


def test_what_stands_still_is_marked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "costs.json").write_text(costs(act=1.0, parameters=1_000_000).to_text())
    words = ["--costs", str(tmp_path / "costs.json"), "--actors", "1", "--bandwidth", "0.001"]
    assert run(["simulate", *words]) == 0
    out = capsys.readouterr().out
    assert "stands still │" in out
    assert "stands still: nothing that was pushed was answered" in out
    picture = tmp_path / "picture.png"
    assert run(["simulate", *words, "--plot", str(picture)]) == 2
    assert "nothing to draw" in capsys.readouterr().err
    assert not picture.exists()


def test_designs_are_compared_with_rollouts_as_they_were_measured(
    file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rollouts.json").write_text(costs(act=0.5, apply=0.1, learn_from="rollouts").to_text())
    words = ["--costs", file, "--costs", str(tmp_path / "rollouts.json"), "--designs", "--actors", "1", "--json"]
    assert run(["simulate", *words]) == 0
    found = {one["design"]: one for one in json.loads(capsys.readouterr().out)["predictions"]}
    assert len(found) == 6
    assert found["rollouts, deltas"]["frames_per_second"] == pytest.approx(100 / 0.5, rel=0.01)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--actors", "1,x"], "'x' is no number of actors"),
        (["--actors", "0"], "'0' is no number of actors; give whole numbers from 1 to 100,000"),
        (["--fan-out", "1"], "'--fan-out': 1 is not in the range"),
        (["--one-host", "--shards", "2"], "cannot be simulated on one host"),
        (["--bandwidth", "0"], "'--bandwidth': 0.0 is not in the range"),
        (["--gil", "2"], "'--gil': 2.0 is not in the range"),
        (["--compress", "zip"], "Unknown compression 'zip'"),
        (["--learn-from", "rollouts", "--compress", "topk"], "Only gradients are compressed"),
        (["--designs", "--compress", "int8"], "--designs has its own --compress"),
        (["--designs", "--one-host"], "--designs has its own --one-host"),
        (["--designs", "--shards", "1"], "--designs has its own --shards"),
        (["--plot", "picture.jpg"], "name a file that ends in .png"),
        (["--costs", "twice"], "two are of the same"),
        (["--preset", "big", "--actors", "1"], "Unknown preset 'big'"),
    ],
)
def test_what_makes_no_sense_is_said_in_one_sentence(
    words: list[str], said: str, file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [file if word == "twice" else word for word in words]
    given = words if "--preset" in words else ["--costs", file, *words]
    assert run(["simulate", *given]) == 2
    assert said in capsys.readouterr().err


def test_a_file_that_is_none_is_said_in_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.json").write_text('{"act": 1}')
    assert run(["simulate", "--costs", str(tmp_path / "bad.json")]) == 2
    error = capsys.readouterr().err
    assert "is no file of costs" in error
    assert error.count("\n") == 1
