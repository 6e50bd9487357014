"""SIGTERM ends a command as Ctrl-C does: at once, and its children with it."""

import signal
from pathlib import Path

import pytest

from tests.integration.commands import SMALL_ROOMS, HozDist
from tests.waiting import until

pytestmark = pytest.mark.integration


def children_of(parent: int) -> list[int]:
    return [int(text) for text in Path(f"/proc/{parent}/task/{parent}/children").read_text().split()]


@pytest.mark.parametrize(
    "words", [("scenes", "render", *SMALL_ROOMS, "--jobs", "2"), ("graph", "build", *SMALL_ROOMS, "--output", "o.json")]
)
def test_a_command_that_renders_is_stopped(
    tmp_path: Path, words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    cache = tmp_path / "views"
    with HozDist(*words, "--cache", str(cache), log=tmp_path / "log") as command:
        until(lambda: any(cache.glob("*/rgb.npy")) or not command.runs, "the first room")
        children = children_of(command.process.pid)
        assert command.stop(signal.SIGTERM) == 130
        assert "Traceback" not in command.said
    until(lambda: not any(Path(f"/proc/{child}").exists() for child in children), "the end of the children")
    assert not (tmp_path / "o.json").exists()
