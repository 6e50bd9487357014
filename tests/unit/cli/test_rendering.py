from queue import Queue
from types import SimpleNamespace
from typing import Any

import pytest

from hoz_dist.cli import rendering
from hoz_dist.cli.main import run
from hoz_dist.errors import HozError


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
