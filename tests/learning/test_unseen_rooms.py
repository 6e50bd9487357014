"""The main job, small: an agent trained in kitchens finds its way in kitchens that it has never seen."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long


def test_an_agent_trained_in_kitchens_succeeds_in_unseen_ones(tmp_path: Path, cache: Path) -> None:
    run = tmp_path / "kitchens"
    command = [sys.executable, "-m", "hoz_dist.cli.main", "train", "--run", str(run), "--cache", str(cache)]
    command += ["--scene", "kitchen", "--frames", "1200000", "--episodes", "400"]
    subprocess.run(command, check=True, timeout=1500)
    results = json.loads((run / "evaluation.json").read_text())
    trained, random = results["all"], results["baselines"]["random"]["all"]
    assert results["episodes"] == 400
    assert trained["sr"]["mean"] > 50.0
    assert trained["sr"]["mean"] > 5 * random["sr"]["mean"]
    assert trained["spl"]["mean"] > 5 * random["spl"]["mean"]
    assert results["baselines"]["oracle"]["all"]["sr"]["mean"] == 100.0
