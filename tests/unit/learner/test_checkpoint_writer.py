import errno
import logging
import os
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from hoz_dist.errors import HozError
from learner.checkpoint import Checkpoint, Stamp, checkpoint_files
from learner.checkpoint_writer import RETRY_S, CheckpointWriter
from learner.core import LearnerCore
from learner.leadership import DeposedError
from tests.unit.learner.disk import full_disk
from tests.unit.learner.making import CONFIG, leading, vector

WAIT_S = 10.0


class Run:
    """A run whose version is the time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.leadership = leading(folder)
        self.writer = CheckpointWriter(folder, self.snapshot, self.leadership, self.before)
        self.record_fails = self.sync_fails = False
        self._checkpoint = LearnerCore(CONFIG, vector(0)).snapshot(0.0)

    def before(self) -> None:
        if self.sync_fails:
            raise OSError(errno.EIO, os.strerror(errno.EIO))

    def snapshot(self, now: float) -> Checkpoint:
        if self.record_fails:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return replace(self._checkpoint, version=int(now))

    def versions(self) -> list[int]:
        return [stamp.version for path in checkpoint_files(self.folder) if (stamp := Stamp.of(path)) is not None]

    def kept(self) -> list[int]:
        return sorted(int(path.stem.partition("-")[2]) for path in self.folder.glob("*.keep"))

    def settle(self, now: float) -> None:
        """Wait until what is being written is written, and tell the writer."""
        barrier = threading.Event()
        self.writer._thread.submit(barrier.set)
        assert barrier.wait(WAIT_S)
        self.writer.poll(now)


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Run]:
    run = Run(tmp_path)
    yield run
    run.leadership.close()


def test_a_save_is_written_beside_the_training(run: Run) -> None:
    run.writer.save(1.0, keep=False)
    run.settle(2.0)
    assert (run.versions(), run.kept()) == ([1], [])
    assert run.writer.close(3.0).name == "0001-000000003.safetensors"
    assert run.versions() == [3, 1]


def test_saves_while_one_is_written_become_one_and_do_not_wait(run: Run) -> None:
    release = threading.Event()
    run.writer._thread.submit(release.wait)
    for now, keep in ((1.0, False), (2.0, True), (3.0, False)):
        run.writer.save(now, keep=keep)
    release.set()
    run.settle(4.0)
    run.settle(5.0)
    assert (run.versions(), run.kept()) == ([4, 1], [4])
    run.writer.close(6.0)


def test_a_failed_save_is_said_once_and_soon_tried_again(run: Run, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    with full_disk(1000):
        run.writer.save(1.0, keep=True)
        run.settle(1.0)
        run.writer.poll(1.0 + RETRY_S)
        run.settle(1.0 + RETRY_S)
    run.writer.poll(2.0 * RETRY_S)
    run.settle(2.0 * RETRY_S)
    assert run.versions() == []
    run.writer.poll(11.0 + RETRY_S)
    run.settle(11.0 + RETRY_S)
    assert (run.versions(), run.kept()) == ([16], [16])
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]
    assert "cannot save a checkpoint" in caplog.text
    run.writer.close(20.0)


@pytest.mark.parametrize("what", ["record_fails", "sync_fails"])
def test_without_the_record_of_its_updates_no_checkpoint_is_saved(
    run: Run, what: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    setattr(run, what, True)
    for now in (1.0, 1.0 + RETRY_S, 1.0 + 2 * RETRY_S):
        if now == 1.0:
            run.writer.save(now, keep=True)
        else:
            run.writer.poll(now)
        run.settle(now)
    assert run.versions() == []
    setattr(run, what, False)
    run.writer.poll(50.0)
    run.settle(50.0)
    assert (run.versions(), run.kept()) == ([50], [50])
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]
    run.writer.close(60.0)


def test_what_was_to_be_kept_and_failed_is_kept_at_the_stop(run: Run) -> None:
    with full_disk(1000):
        run.writer.save(1.0, keep=True)
        run.settle(1.0)
    run.writer.close(2.0)
    assert (run.versions(), run.kept()) == ([2], [2])


def test_a_last_checkpoint_that_cannot_be_written_is_said_in_one_sentence(run: Run) -> None:
    with full_disk(1000), pytest.raises(HozError, match=r"Cannot save the last checkpoint in '.*' \(.+\); make room"):
        run.writer.close(1.0)


@pytest.mark.parametrize("what", ["record_fails", "sync_fails"])
def test_without_the_record_of_its_updates_the_last_checkpoint_is_not_saved_either(run: Run, what: str) -> None:
    setattr(run, what, True)
    with pytest.raises(HozError, match="Cannot save the last checkpoint"):
        run.writer.close(1.0)
    assert run.versions() == []


def test_a_deposed_learner_saves_nothing_and_does_not_try_again(run: Run, caplog: pytest.LogCaptureFixture) -> None:
    with leading(run.folder):
        run.writer.save(1.0, keep=True)
        run.settle(2.0)
        run.writer.poll(2.0 + 2 * RETRY_S)
        run.settle(3.0 + 2 * RETRY_S)
        assert run.versions() == run.kept() == []
        assert [record.levelname for record in caplog.records] == ["WARNING"]
        with pytest.raises(DeposedError):
            run.writer.close(20.0)
    assert run.versions() == run.kept() == []
