import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.reproducing import sessions
from hoz_dist.cli.reproducing.sessions import Session, read_sessions
from hoz_dist.errors import HozError
from tests.waiting import until


def newest(out: Path) -> dict[str, Any]:
    return read_sessions(out)[-1]


def test_what_a_session_took_is_noted_while_it_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "NOTE_S", 0.01)
    with Session(tmp_path, {"table": "some"}):
        # So a kill at any moment leaves the seconds until then.
        until(lambda: newest(tmp_path)["took_seconds"] > 0.0, "a note")
        assert newest(tmp_path)["finished"] is False
    assert newest(tmp_path)["finished"] is True


def test_a_session_that_fails_is_noted_beside_those_before_it(tmp_path: Path) -> None:
    old = {"table": "some", "took_seconds": None}
    (tmp_path / "sessions.json").write_text(json.dumps([old]))
    with pytest.raises(KeyboardInterrupt), Session(tmp_path, {"table": "some", "seeds": 2}):
        raise KeyboardInterrupt
    first, second = read_sessions(tmp_path)
    assert first == old
    assert (second["table"], second["seeds"], second["finished"]) == ("some", 2, False)


def test_what_ended_a_session_is_known_when_it_cannot_be_noted(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()

    def lose_the_folder_and_fail() -> None:
        with Session(out, {"table": "some"}):
            shutil.rmtree(out)
            message = "No learner answers."
            raise HozError(message)

    with pytest.raises(HozError, match="No learner"):
        lose_the_folder_and_fail()


@pytest.mark.parametrize("text", ["", "{}", '[{"took_seconds": 3.0}, 7]'])
def test_a_damaged_file_is_as_none(tmp_path: Path, text: str) -> None:
    (tmp_path / "sessions.json").write_text(text)
    assert read_sessions(tmp_path) == []
    with Session(tmp_path, {"table": "some"}):
        pass
    assert len(read_sessions(tmp_path)) == 1
    assert (tmp_path / "sessions.damaged").read_text() == text  # what people can still read in it is not lost
