import json
import threading
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.categories import TARGETS
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.pushes import EpisodesPush, RoomGraphPush
from tests import wire_samples as samples
from workers.journal import Journal
from workers.json_lines import JsonLines


def test_every_acknowledged_push_is_a_line_as_soon_as_it_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "a0.jsonl"
    episodes = EpisodesPush("a0", 77, 0, episodes=(samples.EPISODE,) * 3)
    room = RoomGraphPush("a0", 77, 1, samples.ROOM, "d1", TARGETS, *samples.zone_graph())
    with Journal(path) as journal:
        for tries, push in enumerate((samples.gradient_push(4), episodes, room, samples.trajectory_push()), start=1):
            journal.write(push, Accepted(2, 10 + tries), tries)
            lines = [json.loads(line) for line in path.read_text().splitlines()]
            assert len(lines) == tries, "a killed actor loses none"
    assert all(line.pop("time") > 1.6e9 for line in lines)
    assert all((line.pop("actor"), line.pop("incarnation"), line.pop("epoch")) == ("a0", 77, 2) for line in lines)
    assert lines == [
        {"kind": "gradient", "sequence": 4, "version": 11, "computed_on": [1, 5], "frames": 40, "tries": 1},
        {"kind": "episodes", "sequence": 0, "version": 12, "episodes": 3, "tries": 2},
        {"kind": "room_graph_push", "sequence": 1, "version": 13, "room": "kitchen/3", "tries": 3},
        {"kind": "trajectory", "sequence": 2, "version": 14, "computed_on": [1, 5], "frames": 13, "tries": 4},
    ]
    with Journal(path) as journal:
        journal.write(episodes, Accepted(2, 20), 1)
    assert len(path.read_text().splitlines()) == 5, "an actor that comes back goes on with its journal"


def test_a_file_that_cannot_be_written_is_said_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"Cannot write the journal '.*' \(Is a directory\); choose another"):
        Journal(tmp_path)
    with Journal(Path("/dev/full")) as journal, pytest.raises(InvalidValueError, match="No space left on device"):
        journal.write(samples.gradient_push(), Accepted(1, 1), 1)


def test_lines_of_two_threads_do_not_run_into_each_other(tmp_path: Path) -> None:
    both = threading.Event()

    class Watched:
        """A file that is written slowly, and notices a second writer."""

        def __init__(self, lines: JsonLines) -> None:
            self._file: Any = lines._file
            self._inside = 0

        def write(self, text: str) -> None:
            self._inside += 1
            if self._inside > 1:
                both.set()
            both.wait(0.03)
            self._file.write(text)
            self._inside -= 1

        def __getattr__(self, name: str) -> Any:
            return getattr(self._file, name)

    with JsonLines(tmp_path / "lines", "journal") as lines:
        lines._file = Watched(lines)  # type: ignore[assignment]
        threads = [threading.Thread(target=lines.write, args=({"n": n},)) for n in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert not both.is_set()
    assert len((tmp_path / "lines").read_text().splitlines()) == 2
