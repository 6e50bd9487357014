import json
import logging
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from hoz_dist.config import RunConfig
from hoz_dist.errors import DamagedFileError, InvalidValueError, NotFoundError
from learner.checkpoint import (
    FOLDER,
    Checkpoint,
    Stamp,
    UnreadableError,
    checkpoint_files,
    kept_checkpoints,
    load_checkpoint,
    newest_readable,
    save_checkpoint,
)
from learner.core import LearnerCore
from learner.events import EpisodesReceived, RoomGraphReceived
from learner.leadership import DeposedError
from tests.unit.learner.disk import PASSING, full_disk, unreadable
from tests.unit.learner.making import (
    CONFIG,
    SIZE,
    answer,
    episodes,
    gradient,
    leading,
    push,
    room_graph,
    room_push,
    vector,
)


@pytest.fixture
def checkpoint() -> Checkpoint:
    core = LearnerCore(CONFIG, vector(99), epoch=3)
    for sequence, room in enumerate(("kitchen/2", "kitchen/1", "bathroom/4")):
        answer(core, RoomGraphReceived(0, room_push(sequence, room_graph(room, sequence))))
    answer(core, EpisodesReceived(0, episodes(0, ("kitchen/1", True), ("bathroom/4", False))))
    push(core, gradient(0, epoch=3), gradient(1, epoch=3, version=1))
    return core.snapshot(now=5.0)


def with_version(checkpoint: Checkpoint, version: int) -> Checkpoint:
    return replace(checkpoint, version=version)


def versions(folder: Path) -> list[int]:
    return [stamp.version for path in checkpoint_files(folder) if (stamp := Stamp.of(path)) is not None]


class Deposing:
    """Files of a leader that is deposed right after it has saved a checkpoint."""

    def __init__(self, run: Path) -> None:
        self.run = run
        self.leadership = leading(run)

    def replace(self, path: Path, write: Callable[[Path], object]) -> None:
        self.leadership.replace(path, write)
        leading(self.run).close()

    def remove(self, path: Path) -> None:
        self.leadership.remove(path)


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[-9] ^= 1
    path.write_bytes(content)


def test_a_checkpoint_comes_back_as_it_was(tmp_path: Path, checkpoint: Checkpoint) -> None:
    path = save_checkpoint(tmp_path / "checkpoints", checkpoint)
    assert path.name == "0003-000000002.safetensors"
    again = load_checkpoint(path)
    for name in ("config", "epoch", "version", "frames", "episodes", "seconds", "graph_versions", "recent", "seen"):
        assert getattr(again, name) == getattr(checkpoint, name), name
    np.testing.assert_array_equal(again.parameters, checkpoint.parameters)
    np.testing.assert_array_equal(again.adam.first_moment, checkpoint.adam.first_moment)
    np.testing.assert_array_equal(again.adam.second_moment, checkpoint.adam.second_moment)
    assert again.adam.steps == 2
    assert [(room.room, room.digest) for room in again.rooms] == [
        ("kitchen/2", "d0"),
        ("kitchen/1", "d0"),
        ("bathroom/4", "d0"),
    ]


def test_its_scene_graphs_are_those_of_the_run(tmp_path: Path, checkpoint: Checkpoint) -> None:
    graphs = load_checkpoint(save_checkpoint(tmp_path, checkpoint)).scene_graphs()
    core = LearnerCore(CONFIG, vector(99), checkpoint=checkpoint)
    assert set(graphs) == {"kitchen", "bathroom"}
    assert graphs["kitchen"].rooms == ("kitchen/1", "kitchen/2")
    assert graphs["kitchen"].version == 2
    np.testing.assert_array_equal(graphs["kitchen"].nodes, core.graphs.scenes["kitchen"].nodes)


def test_the_newest_three_and_those_to_keep_stay(tmp_path: Path, checkpoint: Checkpoint) -> None:
    for version in range(1, 9):
        save_checkpoint(tmp_path, with_version(checkpoint, version), keep=version in {2, 5})
    assert versions(tmp_path) == [8, 7, 6, 5, 2]


def test_of_a_finished_run_that_is_opened_again_and_again_the_last_end_is_kept(
    tmp_path: Path, checkpoint: Checkpoint
) -> None:
    for epoch in range(1, 9):
        save_checkpoint(tmp_path, replace(checkpoint, epoch=epoch, version=9), keep=True)
    assert [Stamp.of(path) for path in checkpoint_files(tmp_path)] == [(8, 9), (7, 9), (6, 9), (5, 9)]
    assert len(list(tmp_path.glob("*.keep"))) == 4


def test_kept_checkpoints_are_of_one_training_each_version_once(tmp_path: Path, checkpoint: Checkpoint) -> None:
    # The end of epoch 2 is damaged, epoch 3 goes on without it; epochs 4 and 5 open the finished run.
    for epoch, version in ((1, 10), (2, 20), (2, 31), (3, 30), (4, 30), (5, 30)):
        save_checkpoint(tmp_path / FOLDER, replace(checkpoint, epoch=epoch, version=version), keep=True)
    kept = [Stamp.of(path) for path in kept_checkpoints(tmp_path)]
    assert kept == [(1, 10), (2, 20), (5, 30)]
    assert [Stamp.of(path) for path in kept_checkpoints(tmp_path / FOLDER)] == kept
    save_checkpoint(tmp_path / FOLDER, replace(checkpoint, epoch=5, version=40))
    assert [Stamp.of(path) for path in kept_checkpoints(tmp_path)] == kept
    assert [Stamp.of(path) for path in kept_checkpoints(tmp_path, with_newest=True)] == [*kept, (5, 40)]
    assert kept_checkpoints(tmp_path / "elsewhere", with_newest=True) == ()


def test_a_learner_that_is_deposed_before_it_deletes_what_is_too_old_does_not_delete_it(
    tmp_path: Path, checkpoint: Checkpoint
) -> None:
    for version in range(1, 4):
        save_checkpoint(tmp_path / "checkpoints", with_version(checkpoint, version))
    files = Deposing(tmp_path)
    with pytest.raises(DeposedError):
        save_checkpoint(tmp_path / "checkpoints", with_version(checkpoint, 4), files=files)
    assert versions(tmp_path / "checkpoints") == [4, 3, 2, 1]
    files.leadership.close()


def test_a_later_epoch_comes_after_an_earlier_one_whatever_the_versions(tmp_path: Path, checkpoint: Checkpoint) -> None:
    for epoch, version in ((9, 30), (10, 20), (11, 25), (10, 22)):
        save_checkpoint(tmp_path, replace(checkpoint, epoch=epoch, version=version), keep=True)
    (tmp_path / "000000099.safetensors").touch()
    (tmp_path / "notes-1.safetensors").touch()
    assert [Stamp.of(path) for path in checkpoint_files(tmp_path)] == [(11, 25), (10, 22), (10, 20), (9, 30)]
    assert load_checkpoint(tmp_path).version == 25


def test_a_deposed_learner_saves_and_deletes_nothing(tmp_path: Path, checkpoint: Checkpoint) -> None:
    folder = tmp_path / "checkpoints"
    with leading(tmp_path) as old:
        for version in range(1, 6):
            save_checkpoint(folder, with_version(checkpoint, version), keep=version == 2, files=old)
        before = sorted(folder.iterdir())
        with leading(tmp_path):
            for keep in (False, True):
                with pytest.raises(DeposedError):
                    save_checkpoint(folder, with_version(checkpoint, 6), keep=keep, files=old)
            assert sorted(folder.iterdir()) == before
    assert versions(folder) == [5, 4, 3, 2]


def test_a_full_disk_leaves_the_older_checkpoint_and_nothing_half_written(
    tmp_path: Path, checkpoint: Checkpoint
) -> None:
    older = save_checkpoint(tmp_path, checkpoint)
    with full_disk(1000), pytest.raises(OSError, match="checkpoint"):
        save_checkpoint(tmp_path, with_version(checkpoint, 9))
    assert list(tmp_path.iterdir()) == [older]
    assert load_checkpoint(tmp_path).version == 2


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99, 1.0])
def test_a_truncated_checkpoint_is_said_to_be_damaged(tmp_path: Path, checkpoint: Checkpoint, share: float) -> None:
    path = save_checkpoint(tmp_path, checkpoint)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * (len(content) - 1))])
    with pytest.raises(DamagedFileError, match="damaged or not a checkpoint"):
        load_checkpoint(path)


def test_any_flipped_byte_is_found(tmp_path: Path, checkpoint: Checkpoint) -> None:
    path = save_checkpoint(tmp_path, checkpoint)
    content = path.read_bytes()
    for position in range(0, len(content), 37):
        flipped = bytearray(content)
        flipped[position] ^= 0x10
        path.write_bytes(flipped)
        with pytest.raises(DamagedFileError):
            load_checkpoint(path)


@pytest.mark.parametrize("content", [b"", b"hello", pickle.dumps({"parameters": [1.0]}), bytes(100)])
def test_another_file_is_no_checkpoint(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "000000001.safetensors"
    path.write_bytes(content)
    with pytest.raises(DamagedFileError):
        load_checkpoint(path)


def test_a_safetensors_file_of_something_else_is_no_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "model.safetensors"
    save_file({"weight": vector(0)}, path)
    with pytest.raises(DamagedFileError):
        load_checkpoint(path)


def test_another_format_is_refused_by_name(
    tmp_path: Path, checkpoint: Checkpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as later:
        later.setattr("learner.checkpoint.FORMAT", 2)
        path = save_checkpoint(tmp_path, checkpoint)
    with pytest.raises(InvalidValueError, match="format 2; this version of hoz-dist reads format 1"):
        load_checkpoint(path)


def test_one_of_an_older_hoz_dist_is_refused_by_name_and_not_passed_over(
    tmp_path: Path, checkpoint: Checkpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which does not make it a damaged one, for which an earlier checkpoint could stand in."""
    save_checkpoint(tmp_path, with_version(checkpoint, 1))
    values = checkpoint.config.to_json()
    del values["approach_weight"]
    with monkeypatch.context() as older:
        older.setattr(RunConfig, "to_json", lambda _: values)
        path = save_checkpoint(tmp_path, with_version(checkpoint, 2))
    for place in (path, tmp_path):
        with pytest.raises(InvalidValueError, match=rf"'{path}' cannot be used: .* not of this version of hoz-dist"):
            load_checkpoint(place)


def test_one_of_another_network_is_not_gone_on_from(checkpoint: Checkpoint) -> None:
    complaint = f"has {SIZE} parameters, .* {SIZE + 2}: it may be of an older version of hoz-dist"
    with pytest.raises(InvalidValueError, match=complaint):
        LearnerCore(CONFIG, vector(0, SIZE + 2), checkpoint=checkpoint)


def test_a_missing_file_and_a_folder_without_checkpoints_are_told_apart_from_damage(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="There is no checkpoint '"):
        load_checkpoint(tmp_path / "000000001.safetensors")
    with pytest.raises(NotFoundError, match="There is no checkpoint in"):
        load_checkpoint(tmp_path)


def test_a_folder_gives_its_newest_checkpoint(tmp_path: Path, checkpoint: Checkpoint) -> None:
    for version in (2, 10, 9):
        save_checkpoint(tmp_path / "checkpoints", with_version(checkpoint, version))
    assert load_checkpoint(tmp_path).version == 10
    assert load_checkpoint(tmp_path / "checkpoints").version == 10


def test_damage_to_the_newest_falls_back_to_the_one_before_and_is_warned_of(
    tmp_path: Path, checkpoint: Checkpoint, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "checkpoints"
    paths = [save_checkpoint(folder, with_version(checkpoint, version)) for version in (1, 2, 3)]
    damage(paths[2])
    with caplog.at_level(logging.WARNING):
        assert load_checkpoint(tmp_path).version == 2
    assert str(paths[2]) in caplog.text
    for path in paths[:2]:
        damage(path)
    with pytest.raises(DamagedFileError, match="None of the 3 checkpoints"):
        load_checkpoint(tmp_path)


@pytest.mark.parametrize("number", PASSING)
def test_what_cannot_be_read_now_is_not_damaged_and_no_reason_to_fall_back(
    tmp_path: Path, checkpoint: Checkpoint, number: int
) -> None:
    folder = tmp_path / "checkpoints"
    paths = [save_checkpoint(folder, with_version(checkpoint, version)) for version in (1, 2, 3)]
    damage(paths[2])
    for path in (paths[1], folder):
        with unreadable(path, number), pytest.raises(UnreadableError, match=rf"Cannot read '{path}' \(.+\); mend"):
            load_checkpoint(tmp_path)
    with unreadable(paths[1], number), pytest.raises(UnreadableError):
        load_checkpoint(paths[1])
    assert load_checkpoint(tmp_path).version == 2


def test_a_checkpoint_that_is_deleted_while_the_newest_is_looked_for_is_no_reason_to_fall_back(
    tmp_path: Path, checkpoint: Checkpoint
) -> None:
    for version in (1, 2):
        save_checkpoint(tmp_path, with_version(checkpoint, version))

    def read(path: Path) -> Checkpoint:
        path.unlink()
        return load_checkpoint(path)

    with pytest.raises(UnreadableError, match="No such file"):
        newest_readable(tmp_path, read)


def test_after_a_fall_back_the_new_checkpoint_is_not_the_one_that_is_deleted(
    tmp_path: Path, checkpoint: Checkpoint
) -> None:
    for version in (7, 8, 9):
        damage(save_checkpoint(tmp_path, with_version(checkpoint, version)))
    path = save_checkpoint(tmp_path, replace(checkpoint, epoch=4, version=5))
    assert load_checkpoint(tmp_path).version == 5
    assert path.exists()


def test_the_metadata_is_plain_json(tmp_path: Path, checkpoint: Checkpoint) -> None:
    path = save_checkpoint(tmp_path, checkpoint)
    header = json.loads(path.read_bytes()[8 : 8 + int.from_bytes(path.read_bytes()[:8], "little")])
    assert json.loads(header["__metadata__"]["hoz"])["config"] == CONFIG.to_json()
    assert set(load_file(path)) >= {"parameters", "adam.first_moment", "rooms/kitchen/1/nodes"}
