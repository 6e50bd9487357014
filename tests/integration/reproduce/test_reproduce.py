"""`hoz-dist reproduce` from nothing to a table, with a kill in between: real runs over real Zenoh."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hoz_dist.cli.main import run
from hoz_dist.config import RunConfig
from hoz_dist.nav.rooms import SPLITS
from hoz_dist.reproduce.budget import BUDGETS
from hoz_dist.reproduce.outcome import Outcome
from hoz_dist.reproduce.tables import TABLES
from hoz_dist.wire.transport.environment import child_environment
from tests.integration.reproduce.tables import FEW_ROOMS, TINY_BUDGET, TINY_TABLE
from tests.waiting import until

STEP_S = 240.0
"""How long a start of the command may take, rendering on a machine that is busy with other work included, seconds."""
pytestmark = [pytest.mark.integration, pytest.mark.timeout(3 * STEP_S)]


def words_for(out: Path, cache: Path) -> list[str]:
    return ["reproduce", "tiny", "--budget", "tiny", "--jobs", "1", "--out", str(out), "--cache", str(cache)]


def start(out: Path, cache: Path, *options: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "tests.integration.reproduce.tiny", *words_for(out, cache), *options],
        env=child_environment() | {"PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_a_killed_command_goes_on_and_makes_the_table(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with start(out, cache) as killed:
        until(lambda: any(out.glob("runs/hoz-*/seed-0/checkpoints/*.keep")), "a checkpoint", STEP_S)
        killed.send_signal(signal.SIGKILL)

    with start(out, cache, "--json") as again:
        printed, told = again.communicate(timeout=STEP_S)
    assert again.returncode == 0, told
    assert "Agents left: 1, of which 1 learn; with 1 at once it takes about" in told

    # The run went on where it was.
    (folder,) = out.glob("runs/hoz-*/seed-0")
    begins = (folder / "updates" / "epoch-0002.jsonl").read_text().splitlines()[0]
    assert json.loads(begins)["from_version"] > 0

    results = json.loads(printed)
    assert list(results["rows"]) == ["hoz", "order 1"]
    for row in results["rows"].values():
        assert (row["trials"], row["episodes"]["all"]) == (2, 20)
        assert row["runs"]["0"]["frames"] >= 6000
        candidates = row["runs"]["0"]["choice"]["candidates"]
        assert len(candidates) == 2
        best = max(candidates, key=lambda one: (one["sr"], one["spl"], one["frames"]))
        assert row["runs"]["0"]["choice"]["checkpoint"] == best["checkpoint"]
        assert row["runs"]["0"]["frames"] == best["frames"]
        # Tested in rooms that nobody trained in or chose by.
        outcome = Outcome.load(out / row["runs"]["0"]["file"])
        assert outcome.rooms == tuple(f"bathroom/{number}" for number in FEW_ROOMS["test"])
        assert outcome.success.shape == (2, 20)
    orders = {name: row["runs"]["0"]["config"]["merge_order"] for name, row in results["rows"].items()}
    assert orders == {"hoz": RunConfig().merge_order, "order 1": 1}
    assert set(results["rows"]["order 1"]["differences"]["hoz"]["all"]["sr"]) == {"difference", "low", "high"}
    assert "| order 1 |" in (out / "tiny-tiny.md").read_text()
    assert (out / "tiny-tiny.png").read_bytes().startswith(b"\x89PNG")
    sessions = json.loads((out / "tiny-tiny.json").read_text())["sessions"]
    assert [session["finished"] for session in sessions] == [False, True]
    assert all(session["took_seconds"] >= 0.0 for session in sessions)

    # What is finished is not done again, the test rooms least of all.
    kept = {path: path.stat().st_mtime_ns for path in out.glob("results/*/*.json")}
    assert len(kept) == 2
    monkeypatch.setitem(TABLES, "tiny", TINY_TABLE)
    monkeypatch.setitem(BUDGETS, "tiny", TINY_BUDGET)
    monkeypatch.setitem(SPLITS, "bathroom", FEW_ROOMS)
    assert run([*words_for(out, cache), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == results
    assert {path: path.stat().st_mtime_ns for path in out.glob("results/*/*.json")} == kept
