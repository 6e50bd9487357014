from pathlib import Path

import pytest

from hoz_dist.errors import DamagedFileError, NotFoundError
from learner.replay import Schedule, UpdateRecord, read_updates


def record(actor: str, sequence: int, rate: float = 0.1) -> UpdateRecord:
    return UpdateRecord(actor, 5, sequence, 0, 0, rate)


def test_records_survive_the_file_exactly(tmp_path: Path) -> None:
    records = [record("a", 0, 1e-3 / 3), record("b", 7, 0.0)]
    file = tmp_path / "updates.jsonl"
    file.write_text("".join(item.to_line() for item in records))
    assert read_updates(file) == records


def test_a_missing_file_is_said_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="Cannot read the recorded updates"):
        read_updates(tmp_path / "updates.jsonl")


@pytest.mark.parametrize("line", ["", "{", "[]", '{"actor": "a"}', record("a", 0).to_line()[:-9], "\xff"])
def test_a_damaged_file_is_said_with_the_line(tmp_path: Path, line: str) -> None:
    file = tmp_path / "updates.jsonl"
    file.write_text(record("a", 0).to_line() + line + "\n", encoding="latin-1")
    with pytest.raises(DamagedFileError, match=r"Line \d of"):
        read_updates(file)


@pytest.mark.parametrize("left", [1, 20, -1])
def test_a_last_line_that_was_not_finished_is_left_out(tmp_path: Path, left: int) -> None:
    file = tmp_path / "updates.jsonl"
    file.write_text(record("a", 0).to_line() + record("b", 1).to_line()[:left])
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
