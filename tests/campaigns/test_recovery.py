"""After a single fault, training goes on as before within seconds."""

from pathlib import Path

import pytest

from tests.campaigns import report
from tests.campaigns.recovery import TARGETS, Times, recovery

pytestmark = pytest.mark.integration


def test_a_standby_takes_over(free_port: int, tmp_path: Path, cache: Path) -> None:
    times = Times(warm_up=0.0, before=1.0, give_up=1.0)
    figures = recovery(tmp_path / "recovery", cache, free_port, ["leader"], ["kill"], 1, times)
    assert figures.recoveries[0].first_seconds is not None
    assert figures.recoveries[0].take_over_seconds is not None


@pytest.mark.long
def test_recovery(free_port: int, tmp_path: Path, cache: Path) -> None:
    figures = recovery(tmp_path / "recovery", cache, free_port, TARGETS)
    report.keep("RECOVERY", figures.to_json())
    assert len(figures.recoveries) == 40
    assert figures.late == []
