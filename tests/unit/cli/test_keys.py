import json
import re
from pathlib import Path

import pytest

from hoz_dist.cli.main import run
from hoz_dist.wire.transport.credentials import load_credentials


@pytest.fixture
def keys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    """An authority in the default folder."""
    monkeypatch.chdir(tmp_path)
    assert run(["keys", "init"]) == 0
    assert capsys.readouterr().out == "Made an authority in keys; never give keys/ca.key away.\n"
    return tmp_path / "keys"


def refusal(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """Run a command that must fail, and return what it says."""
    capsys.readouterr()
    assert run(["keys", *words]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    return said.err.removeprefix("hoz-dist: ").rstrip()


def test_keys_are_made_for_every_role(keys: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for role in ("router", "learner", "actor", "viewer"):
        assert run(["keys", "issue", role, "x"]) == 0
        said = capsys.readouterr().out
        assert re.match(rf"keys/{role}-x: {role} x, valid until \d{{4}}-\d\d-\d\d\n", said)
        assert "start it again" in said
        credentials = load_credentials(keys / f"{role}-x")
        assert (credentials.role, credentials.name) == (role, "x")


def test_several_keys_are_told_as_json(keys: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["keys", "issue", "actor", "a0", "a1", "--days", "3", "--json"]) == 0
    issued = json.loads(capsys.readouterr().out)
    assert [(one["role"], one["name"], one["folder"]) for one in issued] == [
        ("actor", "a0", "keys/actor-a0"),
        ("actor", "a1", "keys/actor-a1"),
    ]
    assert issued[0]["expires"] == load_credentials(keys / "actor-a0").expires.isoformat()


def test_nothing_printed_holds_a_key(keys: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(["keys", "issue", "router", "r0", "--json"])
    run(["keys", "issue", "router", "r0"])
    said = capsys.readouterr()
    for path in (keys / "router-r0" / "key.pem", keys / "ca.key"):
        assert path.read_text().splitlines()[1] not in said.out + said.err
    assert "PRIVATE" not in said.out + said.err


def test_a_second_authority_is_refused(keys: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert refusal(capsys, "init").startswith("'keys' has an authority already")


def test_mistakes_are_said_in_one_sentence(keys: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["keys", "issue", "actor", "a0"]) == 0
    for words, expected in {
        ("issue", "actor", "a0"): "The actor 'a0' has a key already, 'keys/actor-a0'; add --replace to issue it anew.",
        ("issue", "acter", "a1"): "Unknown role 'acter'. Did you mean 'actor'? Known: router, learner, actor, viewer.",
        ("issue", "actor", "a/1"): "The actor name 'a/1' cannot be used on the network: use 1 to 64 letters, digits, "
        "'.', '_' or '-', and start with a letter or digit.",
        ("issue", "actor", "a1", "--host", "h"): "--host, --listen and --at are for routers; leave them out for the "
        "role actor.",
        ("issue", "router", "r0", "--listen", "tcp/0.0.0.0:7447"): "'tcp/0.0.0.0:7447' is not encrypted, so that keys "
        "protect nothing there; write tls/host:port.",
        ("issue", "router", "r0", "--host", "a b"): "'a b' is neither the name nor the address of a machine; write "
        "--host router.example.org.",
        ("issue", "actor", "a1", "--authority", "none"): "'none' holds no authority (ca.pem and ca.key missing); make "
        "one with `hoz-dist keys init`.",
        ("withdraw", "actor", "a1"): "No key was issued for the actor 'a1'; see 'keys/issued.json' for who has one.",
    }.items():
        assert refusal(capsys, *words) == expected
    assert sorted(path.name for path in keys.iterdir() if path.is_dir()) == ["actor-a0"]
    assert not Path("none").exists()


def test_a_routers_key_is_replaced_without_saying_again_where_it_is(keys: Path) -> None:
    place = ["--host", "router.lab", "--listen", "tls/0.0.0.0:443", "--at", "/etc/hoz-dist/keys/router-r0"]
    assert run(["keys", "issue", "router", "r0", *place]) == 0
    file = keys / "router-r0" / "router.json5"
    before = file.read_text()
    assert run(["keys", "issue", "router", "r0", "--replace"]) == 0
    assert file.read_text() == before
    [issued] = json.loads((keys / "issued.json").read_text())["issued"]
    assert issued["hosts"] == ["localhost", "127.0.0.1", "router.lab"]


def test_a_key_is_withdrawn(keys: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(["keys", "issue", "router", "r0"])
    run(["keys", "issue", "viewer", "v0"])
    file = keys / "router-r0" / "router.json5"
    assert "viewer-v0" in file.read_text()
    capsys.readouterr()
    assert run(["keys", "withdraw", "viewer", "v0"]) == 0
    assert capsys.readouterr().out.startswith("Withdrew the key of the viewer v0.\n")
    assert "viewer-v0" not in file.read_text()
