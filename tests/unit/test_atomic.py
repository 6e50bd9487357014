import os
from pathlib import Path

import pytest

from hoz_dist.atomic import TEMPORARY_SUFFIX, remove_left_overs, replace_file, write_atomically
from hoz_dist.errors import InvalidValueError


def test_a_file_is_replaced_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")

    def write(temporary: Path) -> None:
        temporary.write_text("new")
        assert path.read_text() == "old"

    replace_file(path, write)
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")

    def fail(temporary: Path) -> None:
        temporary.write_text("ne")
        raise OSError(28, os.strerror(28))

    with pytest.raises(OSError, match="No space left"):
        replace_file(path, fail)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_two_writers_of_one_file_do_not_meet(tmp_path: Path) -> None:
    path = tmp_path / "file"

    def write(temporary: Path) -> None:
        temporary.write_text("first")
        write_atomically(path, b"second", overwrite=True)
        assert temporary.read_text() == "first"

    replace_file(path, write)
    assert path.read_text() == "first"


def test_a_file_with_the_longest_name_can_be_written(tmp_path: Path) -> None:
    write_atomically(tmp_path / ("n" * 255), b"", overwrite=False)


def test_left_overs_are_removed_and_nothing_else(tmp_path: Path) -> None:

    def killed(temporary: Path) -> None:
        temporary.touch()
        os.link(temporary, temporary.with_name(f".other{TEMPORARY_SUFFIX}"))

    replace_file(tmp_path / "file", killed)
    assert len(list(tmp_path.iterdir())) == 2
    remove_left_overs(tmp_path)
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]


def test_an_existing_file_is_kept_unless_told(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(InvalidValueError, match="--force"):
        write_atomically(path, b"new", overwrite=False)
    assert path.read_text() == "old"
