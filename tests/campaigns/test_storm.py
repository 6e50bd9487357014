"""Everything may be killed or stand still at any moment; what was acknowledged and saved counts exactly once."""

from pathlib import Path

import pytest

from tests.campaigns import report
from tests.campaigns.storm import Settings, storm

pytestmark = pytest.mark.integration


def test_short_storm(free_port: int, tmp_path: Path, cache: Path) -> None:
    settings = Settings(seconds=7.0, faults=5, actors=2, seed=11, pause_s=2.5, restart_s=0.1, calm_s=1.0)
    figures = storm(tmp_path / "storm", cache, free_port, settings)
    assert figures.wrong == []
    assert figures.kills + figures.pauses == 5
    assert figures.audit.covered["gradient"] > 10


@pytest.mark.long
def test_storm(free_port: int, tmp_path: Path, cache: Path) -> None:
    figures = storm(tmp_path / "storm", cache, free_port, Settings(seconds=600.0, faults=66))
    report.keep("STORM", figures.to_json())
    assert figures.wrong == []
    assert figures.late == []
    assert figures.kills + figures.pauses >= 60
