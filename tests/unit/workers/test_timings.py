import json
from pathlib import Path

import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.stages import StageClock
from workers.timings import Timings


def test_each_update_is_a_line_with_all_stages_so_far(tmp_path: Path) -> None:
    clock = StageClock()
    with Timings(tmp_path / "timings", clock) as timings:
        for frames in (100, 200):
            with clock("act"):
                pass
            timings.update(frames, rooms_waiting=3)
    lines = [json.loads(line) for line in (tmp_path / "timings").read_text().splitlines()]
    assert [line["updates"] for line in lines] == [1, 2]
    assert [line["frames"] for line in lines] == [100, 200]
    assert [line["stages"]["act"]["count"] for line in lines] == [1, 2]
    assert lines[0]["rooms_waiting"] == 3
    assert lines[0]["time"] <= lines[1]["time"]


def test_a_file_that_cannot_be_written_is_said_with_its_option(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="with --timings"):
        Timings(tmp_path, StageClock())
