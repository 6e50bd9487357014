import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from hoz_dist.config import RunConfig
from hoz_dist.errors import DamagedFileError, InvalidValueError, NotFoundError, RunMismatchError
from learner.checkpoint import UnreadableError, save_checkpoint
from learner.core import LearnerCore
from learner.leadership import DeposedError
from learner.replay import read_updates
from learner.run_folder import LedRun, RunFolder, read_config
from tests.unit.learner.disk import PASSING, full_disk, unreadable
from tests.unit.learner.making import CONFIG, gradient, leading, push, vector


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@contextmanager
def opened(path: Path, config: RunConfig = CONFIG) -> Iterator[LedRun]:
    """Lead a run as a learner that is no standby does."""
    folder = RunFolder(path, config)
    folder.check()
    folder.make()
    with folder.claim_or_refuse() as leadership:
        yield folder.take_over(leadership)


def test_a_new_folder_becomes_a_run(tmp_path: Path) -> None:
    path = tmp_path / "runs" / "first"
    with opened(path) as run:
        assert (run.leadership.epoch, run.checkpoint) == (1, None)
    assert read_config(path) == CONFIG
    assert read_updates(path) == []


def test_the_same_configuration_resumes_in_a_new_epoch(tmp_path: Path) -> None:
    with opened(tmp_path) as run:
        core = LearnerCore(CONFIG, vector(0), epoch=run.leadership.epoch)
        push(core, gradient(0))
        save_checkpoint(run.folder.checkpoints, core.snapshot(0.0), files=run.leadership)
    with opened(tmp_path) as run:
        assert run.leadership.epoch == 2
        assert run.checkpoint is not None
        assert run.checkpoint.version == 1
        assert json.loads(run.updates.read_text()) == {"epoch": 2, "from_version": 1}


def test_every_learner_opens_a_new_epoch_even_if_the_last_one_saved_nothing(tmp_path: Path) -> None:
    epochs = []
    for _ in range(3):
        with opened(tmp_path) as run:
            epochs.append(run.leadership.epoch)
    assert epochs == [1, 2, 3]


def test_checkpoints_that_were_copied_here_have_had_their_epochs(tmp_path: Path) -> None:
    with opened(tmp_path) as run:
        save_checkpoint(run.folder.checkpoints, LearnerCore(CONFIG, vector(0), epoch=7).snapshot(0.0))
    with opened(tmp_path) as run:
        assert run.leadership.epoch == 8


def test_a_damaged_newest_checkpoint_is_set_aside_and_nothing_is_lost(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    damaged = {}
    for _ in range(2):
        with opened(tmp_path) as run:
            core = LearnerCore(CONFIG, vector(0), epoch=run.leadership.epoch)
            for version in range(3):
                push(core, gradient(version, epoch=core.epoch, version=version))
                newest = save_checkpoint(run.folder.checkpoints, core.snapshot(0.0), files=run.leadership)
        damaged[newest.name + ".damaged"] = newest.read_bytes()[:-9]
        newest.write_bytes(newest.read_bytes()[:-9])
        with opened(tmp_path) as run:
            assert run.checkpoint is not None
            assert run.checkpoint.version == 2
        assert f"'{newest}' is damaged" in caplog.text
    assert list(damaged) == ["0001-000000003.safetensors.damaged", "0003-000000003.safetensors.damaged"]
    for name, content in damaged.items():
        assert (tmp_path / "checkpoints" / name).read_bytes() == content
        assert name in caplog.text


def test_when_every_checkpoint_is_damaged_none_is_touched(tmp_path: Path) -> None:
    with opened(tmp_path) as run:
        save_checkpoint(run.folder.checkpoints, LearnerCore(CONFIG, vector(0)).snapshot(0.0)).write_bytes(b"")
    before = contents(tmp_path)
    with pytest.raises(DamagedFileError, match="None of the 1 checkpoints"), opened(tmp_path):
        pass
    assert contents(tmp_path) == before  # and no epoch was used up either


@pytest.mark.parametrize("number", PASSING)
def test_a_checkpoint_that_cannot_be_read_now_changes_nothing_and_rolls_nothing_back(
    tmp_path: Path, number: int
) -> None:
    with opened(tmp_path) as run:
        core = LearnerCore(CONFIG, vector(0), epoch=run.leadership.epoch)
        for version in range(2):
            push(core, gradient(version, version=version))
            newest = save_checkpoint(run.folder.checkpoints, core.snapshot(0.0), files=run.leadership)
    before = contents(tmp_path)
    for path in (newest, newest.parent, tmp_path):
        with unreadable(path, number), pytest.raises(UnreadableError, match="Cannot read"), opened(tmp_path):
            pass
    assert contents(tmp_path) == before
    checkpoints = contents(tmp_path / "checkpoints")
    with leading(tmp_path) as leadership:
        for path in (newest, newest.parent):
            with unreadable(path, number), pytest.raises(UnreadableError, match="Cannot read"):
                RunFolder(tmp_path, CONFIG).take_over(leadership)
    assert contents(tmp_path / "checkpoints") == checkpoints
    with opened(tmp_path) as run:
        assert run.checkpoint is not None
        assert (run.leadership.epoch, run.checkpoint.version) == (3, 2)


def test_a_full_disk_is_said_in_one_sentence(tmp_path: Path) -> None:
    with full_disk(1), pytest.raises(InvalidValueError, match="Cannot write the run folder"), opened(tmp_path):
        pass
    with opened(tmp_path):  # and nothing is left that would keep others out
        pass


def test_another_configuration_is_refused_with_each_difference(tmp_path: Path) -> None:
    with opened(tmp_path):
        pass
    before = contents(tmp_path)
    with (
        pytest.raises(RunMismatchError, match=r"zones: 3, 5.*seed: 0, 7|seed: 0, 7.*zones: 3, 5"),
        opened(tmp_path, replace(CONFIG, zones=5, seed=7)),
    ):
        pass
    assert contents(tmp_path) == before


def test_a_configuration_that_came_while_a_standby_waited_is_compared_too(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, replace(CONFIG, seed=7))
    folder.check()
    with opened(tmp_path):
        pass
    with pytest.raises(RunMismatchError, match="seed"):
        folder.claim_or_refuse()
    assert folder.newest_epoch() == 1
    with leading(tmp_path) as leadership, pytest.raises(RunMismatchError, match="seed"):
        folder.take_over(leadership)


def test_who_was_deposed_while_it_began_the_run_writes_no_configuration(tmp_path: Path) -> None:
    slow, fast = RunFolder(tmp_path, replace(CONFIG, seed=7)), RunFolder(tmp_path, CONFIG)
    with slow.claim_or_refuse() as first:
        second = fast.claim(first.epoch)
        assert second is not None
        with pytest.raises(DeposedError):
            slow.take_over(first)
        with second:
            fast.take_over(second)
    assert read_config(tmp_path) == CONFIG
    assert [path.name for path in (tmp_path / "updates").iterdir()] == ["epoch-0002.jsonl"]


def test_a_folder_of_something_else_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InvalidValueError, match="holds files but is not a run"), opened(tmp_path):
        pass
    assert contents(tmp_path) == {"thesis.tex": b"years of work"}


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(InvalidValueError, match="is a file"), opened(file):
        pass
    with pytest.raises(InvalidValueError, match="Cannot use"), opened(file / "below"):
        pass
    assert file.read_text() == "mine"


def test_a_second_learner_is_kept_out_while_the_first_runs(tmp_path: Path) -> None:
    with opened(tmp_path) as first, pytest.raises(InvalidValueError, match="Another learner"), opened(tmp_path):
        pass
    assert first.leadership.epoch == 1
    with opened(tmp_path) as run:
        assert run.leadership.epoch == 2


def test_what_a_killed_learner_left_does_not_make_a_folder_foreign(tmp_path: Path) -> None:
    RunFolder(tmp_path, CONFIG).claim_or_refuse().close()
    (tmp_path / ".4711.tmp").touch()
    with opened(tmp_path) as run:
        assert run.leadership.epoch == 2


@pytest.mark.parametrize("text", ["", "{", "[]", '{"zones": 3}', json.dumps({**CONFIG.to_json(), "zones": "3"})])
def test_an_unreadable_configuration_is_said_and_left_alone(tmp_path: Path, text: str) -> None:
    (tmp_path / "config.json").write_text(text)
    with pytest.raises(DamagedFileError, match=r"config\.json"), opened(tmp_path):
        pass
    assert (tmp_path / "config.json").read_text() == text


def test_a_folder_without_a_configuration_is_no_run(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="is not a run"):
        read_config(tmp_path)
