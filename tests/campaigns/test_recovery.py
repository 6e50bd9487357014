"""After a single fault, training goes on as before within seconds."""

from pathlib import Path

import pytest

from tests.campaigns import report
from tests.campaigns.recovery import TARGETS, recovery

pytestmark = pytest.mark.integration


def test_a_standby_takes_over(free_port: int, tmp_path: Path, cache: Path) -> None:
    figures = recovery(tmp_path / "recovery", cache, free_port, ["leader"], ["kill"], repeats=1, before_s=3.0)
    assert figures.recoveries[0].seconds is not None
    assert figures.recoveries[0].take_over_seconds is not None


@pytest.mark.long
def test_recovery(free_port: int, tmp_path: Path, cache: Path) -> None:
    figures = recovery(tmp_path / "recovery", cache, free_port, TARGETS)
    report.keep("RECOVERY", figures.to_json())
    assert len(figures.recoveries) == 40
    assert figures.late == []
