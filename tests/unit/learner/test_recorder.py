import errno
import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from hoz_dist.errors import InvalidValueError
from learner.core import LearnerCore
from learner.events import EpisodesReceived
from learner.recorder import RETRY_RECORDS, ScalarRecorder, UpdateLog
from learner.replay import EpochStart, UpdateRecord, read_updates
from tests.unit.learner.disk import full_disk
from tests.unit.learner.making import CONFIG, answer, episodes, gradient, push, vector


def record(sequence: int) -> UpdateRecord:
    return UpdateRecord("a", 1, sequence, sequence, 0, 0.1)


def begun(path: Path, epoch: int = 1, version: int = 0) -> Path:
    """A record in which nothing is yet but how it began."""
    path.write_text(EpochStart(epoch, version).to_line())
    return path


def test_updates_are_added_after_what_is_there(tmp_path: Path) -> None:
    path = begun(tmp_path / "epoch-0001.jsonl")
    for number in range(3):
        log = UpdateLog(path)
        log.write(record(number))
        log.flush()
        log.close()
    assert read_updates(path) == [record(0), record(1), record(2)]


def test_updates_that_a_full_disk_did_not_take_are_written_later_and_none_twice(tmp_path: Path) -> None:
    path = begun(tmp_path / "epoch-0001.jsonl")
    log = UpdateLog(path)
    length, start = len(record(0).to_line()), path.stat().st_size
    with full_disk(start + int(2.5 * length)):
        for sequence in range(4):
            log.write(record(sequence))
            if sequence < 2:
                log.flush()
            else:
                with pytest.raises(OSError, match="too large"):
                    log.flush()
    # What a reader finds meanwhile is a line that is not finished.
    assert read_updates(path) == [record(0), record(1)]
    log.write(record(4))
    log.flush()
    log.close()
    assert read_updates(path) == [record(sequence) for sequence in range(5)]


def test_lines_that_the_system_lost_are_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = begun(tmp_path / "epoch-0001.jsonl")
    log = UpdateLog(path)
    log.write(record(0))
    log.flush()
    log.sync()
    safe = path.stat().st_size
    log.write(record(1))
    log.flush()

    def lose(_: int) -> None:
        os.truncate(path, safe)
        raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))

    with monkeypatch.context() as later:
        later.setattr("learner.recorder.os.fsync", lose)
        with pytest.raises(OSError, match="quota"):
            log.sync()
    log.write(record(2))
    log.flush()
    log.sync()
    assert not log._lines
    log.close()
    assert read_updates(path) == [record(0), record(1), record(2)]


def test_lines_that_come_while_the_disk_is_waited_for_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = begun(tmp_path / "epoch-0001.jsonl")
    log = UpdateLog(path)

    def meanwhile(_: int) -> None:
        log.write(record(1))
        log.flush()
        log.write(record(2))

    log.write(record(0))
    log.flush()
    with monkeypatch.context() as later:
        later.setattr("learner.recorder.os.fsync", meanwhile)
        log.sync()
    assert bytes(log._lines).decode() == record(1).to_line() + record(2).to_line()
    log.flush()
    log.sync()
    log.close()
    assert read_updates(path) == [record(0), record(1), record(2)]


def test_a_record_that_cannot_be_written_is_said_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="Cannot write"):
        UpdateLog(tmp_path)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")  # of TensorBoard's own thread
def test_scalars_that_a_full_disk_does_not_take_are_left_out(tmp_path: Path) -> None:
    core = LearnerCore(CONFIG, vector(0))
    scalars = ScalarRecorder(tmp_path, 0)
    scalars.record(core.status(0.0))
    with full_disk(100):
        for _ in range(3):
            with pytest.raises(OSError, match="too large"):
                scalars.record(core.status(0.0))
    push(core, gradient(0))
    for _ in range(RETRY_RECORDS):
        with suppress(OSError):
            scalars.record(core.status(1.0))
    scalars.record(core.status(1.0))
    scalars.close()
    assert EventAccumulator(str(tmp_path)).Reload().Scalars("n_frames")[-1].value == 10.0


def test_scalars_are_logged_over_frames(tmp_path: Path) -> None:
    core = LearnerCore(replace(CONFIG, frames=100), vector(0))
    scalars = ScalarRecorder(tmp_path, core.statistics.frames)
    scalars.record(core.status(0.0))
    told = episodes(0, ("kitchen/1", True), ("bathroom/1", False))
    answer(core, EpisodesReceived(0, replace(told, entropy=1.5, approach_loss=0.75)))
    push(core, *(gradient(sequence, version=0) for sequence in range(3)))
    scalars.record(core.status(1.0))
    scalars.close()
    events = EventAccumulator(str(tmp_path)).Reload()

    def last(tag: str) -> tuple[int, float]:
        event = events.Scalars(tag)[-1]
        return event.step, event.value

    assert last("n_frames") == (30, 30.0)
    assert last("success/train") == (30, 0.5)
    assert last("success_kitchen/train") == (30, 1.0)
    assert last("train/version_diff_min") == (30, 0.0)
    assert last("train/version_diff_avg") == (30, 1.0)
    assert last("train/version_diff_max") == (30, 2.0)
    assert last("train/learning_rate")[1] == pytest.approx(0.008)
    assert last("perf/_fps") == (30, 30.0)
    assert last("loss/entropy") == (30, 1.5)
    assert last("loss/approach_loss") == (30, 0.75)
    assert "loss/imitation_loss" not in events.Tags()["scalars"], "nothing is imitated"
