"""A real learner that learns from the rollouts of a real actor, and is killed."""

import signal
from pathlib import Path

import pytest

from hoz_dist.client import HozClient
from learner.checkpoint import load_checkpoint
from learner.replay import read_updates
from tests.campaigns.audit import audit
from tests.campaigns.journals import read_journal
from tests.integration.commands import SMALL_ROOMS, HozDist
from tests.integration.learning import LearnerProcess, status_when, wait_for_checkpoint

pytestmark = pytest.mark.integration


def test_what_was_acknowledged_counts_once_though_the_learner_was_killed_and_goes_on(
    free_port: int, tmp_path: Path, cache: Path
) -> None:
    run = tmp_path / "run"
    options = ("--learn-from", "rollouts", "--cache", str(cache), "--checkpoint-seconds", "1")
    journal = tmp_path / "anna.jsonl"
    with LearnerProcess(free_port, run, *options).ready() as learner:
        words = ("actor", "--scene", SMALL_ROOMS[0], "--connect", learner.endpoint, "--name", "anna")
        files = ("--journal", str(journal), "--cache", str(cache))
        with HozDist(*words, *files, log=tmp_path / "anna.log") as actor:
            with HozClient(learner.endpoint) as client:
                status = status_when(client, lambda status: status["version"] > 3 and status["episodes"] > 0)
            assert status["rejected"] == {}
            assert status["losses"]["entropy"] > 0.5
            assert status["losses"]["approach_loss"] > 0.0
            assert status["lag"]["mean"] == pytest.approx(1.0, abs=0.5), "the next rollout is acted meanwhile"
            wait_for_checkpoint(run, version=3)
            learner.kill()
            saved = load_checkpoint(run)
            with LearnerProcess(free_port, run, *options).ready() as again:
                with HozClient(again.endpoint) as client:
                    status = status_when(client, lambda status: status["version"] > saved.version + 2)
                assert status["epoch"] == 2
                assert status["frames"] > saved.frames
                assert set(status["rejected"]) <= {"epoch", "stale"}
                assert actor.runs
                assert actor.stop(signal.SIGTERM) == 0
                assert again.stop(signal.SIGTERM) == 0
    assert "Traceback" not in actor.said
    resumed = load_checkpoint(run)
    assert resumed.version > saved.version
    assert len(read_updates(run)) == resumed.version
    figures = audit(run, read_journal(journal)).figures
    assert figures.problems == []
    assert figures.covered["trajectory"] > saved.version
