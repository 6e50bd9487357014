import json
from dataclasses import replace
from pathlib import Path

import pytest

from hoz_dist.errors import DamagedFileError, InvalidValueError, NotFoundError, RunMismatchError
from learner.checkpoint import save_checkpoint
from learner.core import LearnerCore
from learner.run_folder import open_run_folder, read_config
from tests.unit.learner.disk import full_disk
from tests.unit.learner.making import CONFIG, gradient, push, vector


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_new_folder_becomes_a_run(tmp_path: Path) -> None:
    path = tmp_path / "runs" / "first"
    with open_run_folder(path, CONFIG) as folder:
        assert (folder.epoch, folder.checkpoint) == (1, None)
    assert read_config(path) == CONFIG


def test_the_same_configuration_resumes_in_a_new_epoch(tmp_path: Path) -> None:
    with open_run_folder(tmp_path, CONFIG) as folder:
        core = LearnerCore(CONFIG, vector(0), epoch=folder.epoch)
        push(core, gradient(0))
        save_checkpoint(folder.checkpoints, core.snapshot(0.0))
    with open_run_folder(tmp_path, CONFIG) as folder:
        assert folder.epoch == 2
        assert folder.checkpoint is not None
        assert folder.checkpoint.version == 1


def test_every_learner_opens_a_new_epoch_even_if_the_last_one_saved_nothing(tmp_path: Path) -> None:
    epochs = []
    for _ in range(3):
        with open_run_folder(tmp_path, CONFIG) as folder:
            epochs.append(folder.epoch)
    assert epochs == [1, 2, 3]


def test_a_damaged_newest_checkpoint_is_set_aside_and_nothing_is_lost(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    lines = "".join(f"{number}\n" for number in range(3))
    damaged = []
    for _ in range(2):
        with open_run_folder(tmp_path, CONFIG) as folder:
            core = LearnerCore(CONFIG, vector(0), epoch=folder.epoch)
            for version in range(3):
                push(core, gradient(version, epoch=core.epoch, version=version))
                newest = save_checkpoint(folder.checkpoints, core.snapshot(0.0))
            folder.updates.write_text(lines)
        damaged.append(newest.read_bytes()[:-9])
        newest.write_bytes(damaged[-1])
        with open_run_folder(tmp_path, CONFIG) as folder:
            assert folder.checkpoint is not None
            assert folder.checkpoint.version == 2
        assert f"'{newest}' is damaged" in caplog.text
    names = ("000000003.safetensors.damaged", "000000003.safetensors.damaged.2")
    for name, content in zip(names, damaged, strict=True):
        assert (tmp_path / "checkpoints" / name).read_bytes() == content
        assert name in caplog.text
    for name in ("updates-000000003.jsonl", "updates-000000003.jsonl.2"):
        assert (tmp_path / name).read_text() == lines
        assert name in caplog.text


def test_when_every_checkpoint_is_damaged_nothing_is_touched(tmp_path: Path) -> None:
    with open_run_folder(tmp_path, CONFIG) as folder:
        save_checkpoint(folder.checkpoints, LearnerCore(CONFIG, vector(0)).snapshot(0.0)).write_bytes(b"")
    before = contents(tmp_path)
    with pytest.raises(DamagedFileError, match="None of the 1 checkpoints"), open_run_folder(tmp_path, CONFIG):
        pass
    assert contents(tmp_path) == before


def test_a_full_disk_is_said_in_one_sentence(tmp_path: Path) -> None:
    with (
        full_disk(1),
        pytest.raises(InvalidValueError, match="Cannot write the run folder"),
        open_run_folder(tmp_path, CONFIG),
    ):
        pass


def test_another_configuration_is_refused_with_each_difference(tmp_path: Path) -> None:
    with open_run_folder(tmp_path, CONFIG):
        pass
    before = contents(tmp_path)
    with (
        pytest.raises(RunMismatchError, match=r"zones: 3, 5.*seed: 0, 7|seed: 0, 7.*zones: 3, 5"),
        open_run_folder(tmp_path, replace(CONFIG, zones=5, seed=7)),
    ):
        pass
    assert contents(tmp_path) == before


def test_a_folder_of_something_else_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InvalidValueError, match="holds files but is not a run"), open_run_folder(tmp_path, CONFIG):
        pass
    assert contents(tmp_path) == {"thesis.tex": b"years of work"}


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(InvalidValueError, match="is a file"), open_run_folder(file, CONFIG):
        pass
    with pytest.raises(InvalidValueError, match="Cannot use"), open_run_folder(file / "below", CONFIG):
        pass
    assert file.read_text() == "mine"


def test_a_second_learner_is_kept_out_while_the_first_runs(tmp_path: Path) -> None:
    with (
        open_run_folder(tmp_path, CONFIG),
        pytest.raises(InvalidValueError, match="Another learner"),
        open_run_folder(tmp_path, CONFIG),
    ):
        pass
    with open_run_folder(tmp_path, CONFIG) as folder:
        assert folder.epoch == 2


def test_what_a_killed_learner_left_does_not_make_a_folder_foreign(tmp_path: Path) -> None:
    for name in ("learner.lock", "config.json.tmp"):
        (tmp_path / name).touch()
    with open_run_folder(tmp_path, CONFIG) as folder:
        assert folder.epoch == 1


@pytest.mark.parametrize("text", ["", "{", "[]", '{"zones": 3}', json.dumps({**CONFIG.to_json(), "zones": "3"})])
def test_an_unreadable_configuration_is_said_and_left_alone(tmp_path: Path, text: str) -> None:
    (tmp_path / "config.json").write_text(text)
    with pytest.raises(DamagedFileError, match=r"config\.json"), open_run_folder(tmp_path, CONFIG):
        pass
    assert (tmp_path / "config.json").read_text() == text


def test_an_unreadable_epoch_is_said(tmp_path: Path) -> None:
    with open_run_folder(tmp_path, CONFIG):
        pass
    (tmp_path / "epoch").write_text("two")
    with pytest.raises(DamagedFileError, match="epoch"), open_run_folder(tmp_path, CONFIG):
        pass


def test_a_folder_without_a_configuration_is_no_run(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="is not a run"):
        read_config(tmp_path)
