import json
from pathlib import Path

import pytest

from hoz_dist.cli.main import run
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.view_store import ViewStore

pytestmark = pytest.mark.integration


def states(text: str) -> dict[str, str]:
    return {check["check"]: check["state"] for check in json.loads(text)["checks"]}


def test_a_healthy_machine_passes_every_check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["doctor", "--cache", str(tmp_path / "views")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(line.split()[0] in {"ok", "warn"} for line in lines)
    assert any("rendering" in line and "ms a picture" in line for line in lines)
    assert not (tmp_path / "views").exists(), "doctor only looks"


def test_a_damaged_room_in_the_cache_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ViewStore(tmp_path, picture_size=24).graph(RoomId("bathroom", 1))
    assert run(["doctor", "--cache", str(tmp_path), "--json"]) == 0
    assert states(capsys.readouterr().out)["cached rooms"] == "ok"

    (header,) = tmp_path.glob("bathroom-1-*/header.json")
    header.write_text("{")
    assert run(["doctor", "--cache", str(tmp_path), "--json"]) == 0
    out = capsys.readouterr().out
    assert states(out)["cached rooms"] == "warn"
    assert header.parent.name in out


def test_a_cache_that_cannot_be_written_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("not a folder")
    assert run(["doctor", "--cache", str(tmp_path / "file" / "views"), "--json"]) == 1
    assert states(capsys.readouterr().out)["cache"] == "fail"


def test_a_router_that_is_not_there_fails(tmp_path: Path, free_port: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["doctor", "--cache", str(tmp_path), "--connect", f"tcp/127.0.0.1:{free_port}", "--json"]) == 1
    assert states(capsys.readouterr().out)["router"] == "fail"
