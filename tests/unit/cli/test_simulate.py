"""`hoz-dist simulate`, as one calls it."""

import json
from pathlib import Path

import pytest

from hoz_dist.cli.main import run
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


def test_json_has_every_figure_of_every_number(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--latency", "5", "--max-lag", "1000", "--json"]
    assert run(["simulate", "--costs", file, "--actors", "1,2", *words]) == 0
    one, two = json.loads(capsys.readouterr().out)["predictions"]
    assert one["frames_per_second"] == pytest.approx(100 / (1.0 + 0.01 + 4 * 0.005), rel=0.01)
    assert two["actors"] == 2
    assert {"lag", "stale", "busy", "apply_load", "up_load", "bottleneck", "took_seconds"} <= set(two)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--actors", "1,x"], "'x' is no number of actors"),
        (["--actors", "0"], "'actors' is 0; it must be from 1"),
        (["--fan-out", "1"], "'fan_out' is 1; it must be from 2"),
        (["--one-host", "--shards", "2"], "cannot be simulated on one host"),
        (["--bandwidth", "0"], "'bandwidth' is 0"),
        (["--compress", "zip"], "Unknown compression 'zip'"),
        (["--preset", "big", "--actors", "1"], "Unknown preset 'big'"),
    ],
)
def test_what_makes_no_sense_is_said_in_one_sentence(
    words: list[str], said: str, file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = words if "--preset" in words else ["--costs", file, *words]
    assert run(["simulate", *given]) == 2
    assert said in capsys.readouterr().err


def test_a_file_that_is_none_is_said_in_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.json").write_text('{"act": 1}')
    assert run(["simulate", "--costs", str(tmp_path / "bad.json")]) == 2
    error = capsys.readouterr().err
    assert "is no file of costs" in error
    assert error.count("\n") == 1
