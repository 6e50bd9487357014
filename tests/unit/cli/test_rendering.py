import os
import signal
from collections.abc import Iterator
from pathlib import Path
from queue import Queue
from types import SimpleNamespace
from typing import Any

import pytest

from hoz_dist.cli import rendering
from hoz_dist.cli.main import run
from hoz_dist.errors import HozError
from tests.integration.commands import HozDist
from tests.waiting import until


def test_advice_for_a_killed_process_is_a_command_that_there_is(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(rendering, "_POLL_S", 0.01)
    workers: list[Any] = [SimpleNamespace(exitcode=None), SimpleNamespace(exitcode=-9)]
    reports: Any = Queue()
    with pytest.raises(HozError, match=r"want of memory; .* 'hoz-dist scenes render --jobs 1'"):
        rendering._follow(workers, reports, 1)
    assert run(["scenes", "render", "--help"]) == 0
    assert "--jobs" in capsys.readouterr().out


@pytest.fixture
def command(tmp_path: Path) -> Iterator[HozDist]:
    """A command that renders more than it can before it is killed."""
    words = ("scenes", "render", "bathroom", "--picture-size", "16", "--jobs", "1", "--cache", str(tmp_path / "views"))
    with HozDist(*words, log=tmp_path / "log") as command:
        yield command


@pytest.mark.integration
def test_a_killed_command_leaves_no_process_that_renders(command: HozDist, tmp_path: Path) -> None:
    until(lambda: any(tmp_path.glob("views/*/rgb.npy")) or not command.runs, "the first room")
    children = children_of(command.process.pid)
    assert children, command.said
    try:
        assert command.stop(signal.SIGKILL) == -signal.SIGKILL, command.said
        # Far less than the rest of the rooms takes.
        until(lambda: not any(map(runs, children)), "the end of the children", 5.0)
    finally:
        for child in filter(runs, children):
            os.kill(child, signal.SIGKILL)


def children_of(parent: int) -> list[int]:
    return [int(text) for text in Path(f"/proc/{parent}/task/{parent}/children").read_text().split()]


def runs(process: int) -> bool:
    """Tell whether a process runs; one that nobody has waited for yet, as in a container without an init, does not."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(") ")[2]
    except FileNotFoundError:
        return False
    return not state.startswith("Z")
