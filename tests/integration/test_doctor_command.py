import json
from datetime import timedelta
from pathlib import Path

import pytest

from hoz_dist.cli.main import run
from hoz_dist.nav.rooms import RoomId
from hoz_dist.security.key_folders import RouterPlace, create_authority, issue_keys
from hoz_dist.sim.view_store import ViewStore
from hoz_dist.wire.transport.credentials import ROUTER_FILE
from hoz_dist.wire.transport.session import open_configured_router

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


def test_a_router_with_keys_is_asked_with_a_key(
    tmp_path: Path, free_port: int, capsys: pytest.CaptureFixture[str]
) -> None:
    keys, endpoint = tmp_path / "keys", f"tls/127.0.0.1:{free_port}"
    create_authority(keys)
    [(_, router)] = issue_keys(keys, "router", ["main"], timedelta(days=1), RouterPlace(listen=(endpoint,)))
    [(_, viewer)] = issue_keys(keys, "viewer", ["v"], timedelta(days=1))
    words = ["doctor", "--cache", str(tmp_path / "views"), "--connect", endpoint, "--json"]
    with open_configured_router(router / ROUTER_FILE):
        assert run([*words, "--keys", str(viewer)]) == 0
        out = capsys.readouterr().out
        assert states(out)["router"] == "warn"
        assert "no learner" in out
        assert run(words) == 1
    assert run(["doctor", "--keys", str(viewer)]) == 2
    assert "they need --connect" in capsys.readouterr().err


def test_a_router_that_is_not_there_fails(tmp_path: Path, free_port: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["doctor", "--cache", str(tmp_path), "--connect", f"tcp/127.0.0.1:{free_port}", "--json"]) == 1
    assert states(capsys.readouterr().out)["router"] == "fail"
