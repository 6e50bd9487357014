from pathlib import Path

import pytest

from hoz_dist.errors import DamagedFileError, NotFoundError
from learner.replay import EpochStart, Schedule, UpdateRecord, read_updates


def record(actor: str, sequence: int, rate: float = 0.1) -> UpdateRecord:
    return UpdateRecord(actor, 5, sequence, 0, 0, rate)


def written(folder: Path, epoch: int, version: int, *records: UpdateRecord) -> Path:
    """Write the record of one epoch, which began from a version."""
    start = EpochStart(epoch, version)
    file = folder / start.file_name
    file.parent.mkdir(exist_ok=True)
    file.write_text(start.to_line() + "".join(item.to_line() for item in records))
    return file


def test_records_survive_the_file_exactly(tmp_path: Path) -> None:
    records = [record("a", 0, 1e-3 / 3), record("b", 7, 0.0)]
    assert read_updates(written(tmp_path, 1, 0, *records)) == records


def test_epochs_are_joined_and_what_a_killed_learner_lost_does_not_count(tmp_path: Path) -> None:
    folder = tmp_path / "updates"
    written(folder, 1, 0, *(record("a", number) for number in range(5)))
    written(folder, 2, 3, record("b", 0), record("b", 1))
    written(folder, 3, 3)  # it came in, and was killed before its first checkpoint
    written(folder, 10, 3, record("c", 0), record("c", 1))
    written(folder, 11, 5, record("d", 0))
    joined = [*(record("a", number) for number in range(3)), record("c", 0), record("c", 1), record("d", 0)]
    assert read_updates(folder) == read_updates(tmp_path) == joined


def test_what_a_deposed_learner_still_writes_into_its_record_does_not_count(tmp_path: Path) -> None:
    old = written(tmp_path, 1, 0, record("a", 0))
    written(tmp_path, 2, 1, record("b", 0))
    with old.open("a") as file:
        file.write(record("a", 1).to_line() + record("a", 2).to_line())
    assert read_updates(tmp_path) == [record("a", 0), record("b", 0)]


def test_updates_that_are_missing_are_said(tmp_path: Path) -> None:
    written(tmp_path, 1, 0, record("a", 0))
    second = written(tmp_path, 2, 4, record("b", 0))
    with pytest.raises(DamagedFileError, match="lacks the updates between versions 1 and 4"):
        read_updates(tmp_path)
    with pytest.raises(DamagedFileError, match="lacks the updates between versions 0 and 4"):
        read_updates(second)


def test_a_missing_file_is_said_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="Cannot read the recorded updates"):
        read_updates(tmp_path / "epoch-0001.jsonl")
    with pytest.raises(NotFoundError, match="There are no recorded updates"):
        read_updates(tmp_path)


@pytest.mark.parametrize("line", ["", "{", "[]", '{"actor": "a"}', record("a", 0).to_line()[:-9], "\xff"])
def test_a_damaged_file_is_said_with_the_line(tmp_path: Path, line: str) -> None:
    file = written(tmp_path, 1, 0, record("a", 0))
    file.write_text(file.read_text() + line + "\n", encoding="latin-1")
    with pytest.raises(DamagedFileError, match=r"Line \d of"):
        read_updates(file)


@pytest.mark.parametrize("content", ["", "\n", '{"epoch": 1}\n', record("a", 0).to_line()])
def test_a_file_that_does_not_begin_as_a_record_is_said(tmp_path: Path, content: str) -> None:
    file = tmp_path / "epoch-0001.jsonl"
    file.write_text(content)
    with pytest.raises(DamagedFileError, match="Line 1 of"):
        read_updates(file)


@pytest.mark.parametrize("left", [1, 20, -1])
def test_a_last_line_that_was_not_finished_is_left_out(tmp_path: Path, left: int) -> None:
    file = written(tmp_path, 1, 0, record("a", 0))
    file.write_text(file.read_text() + record("b", 1).to_line()[:left])
    assert read_updates(file) == [record("a", 0)]


def test_a_restarted_learner_goes_on_in_the_record() -> None:
    schedule = Schedule([record("a", 0), record("b", 0), record("a", 1)], applied=2)
    assert (schedule.applied, schedule.total, schedule.done) == (2, 3, False)
    assert (schedule.turn("b", 0), schedule.turn("a", 1)) == ("never", "now")
    assert schedule.actors == ["a", "b"]


def test_updates_are_taken_in_the_recorded_order() -> None:
    schedule = Schedule([record("a", 0, 0.3), record("b", 0, 0.2), record("a", 2, 0.1)])
    assert [schedule.turn(*push) for push in (("a", 0), ("b", 0), ("a", 1), ("a", 2))] == [
        "now",
        "later",
        "never",
        "later",
    ]
    assert schedule.take(0) == 0.3
    assert (schedule.turn("a", 0), schedule.turn("b", 0)) == ("never", "now")
    assert schedule.take(0) == 0.2
    assert schedule.take(9) == 0.1
    assert schedule.done
    assert schedule.diverged == 1


def test_a_restarted_actors_numbers_can_come_twice() -> None:
    schedule = Schedule([record("a", 0), record("a", 1), record("a", 0)])
    schedule.take(0)
    assert schedule.turn("a", 0) == "later"
