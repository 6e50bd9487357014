"""Actors far away, over links that lose packets and are cut."""

from pathlib import Path

import pytest

from tests.campaigns import report
from tests.campaigns.namespaces import BadLink, what_is_missing
from tests.campaigns.network import Settings, network


@pytest.fixture(scope="module", autouse=True)
def _namespaces() -> None:
    missing = what_is_missing()
    if missing is not None:
        pytest.skip(missing)


pytestmark = pytest.mark.integration


def test_a_link_that_was_cut_heals(tmp_path: Path, cache: Path) -> None:
    link = BadLink(delay_ms=5.0, loss_percent=1)
    settings = Settings(link, warm_up_s=0.0, measure_s=1.0, cut_s=5.0, cut_far=False)
    figures = network(tmp_path / "network", cache, settings)
    assert figures.wrong == []
    assert figures.far_accepted > 0


@pytest.mark.long
@pytest.mark.parametrize("congestion_control", ["cubic", "bbr"])
def test_network(congestion_control: str, tmp_path: Path, cache: Path) -> None:
    settings = Settings(congestion_control=congestion_control)
    figures = network(tmp_path / "network", cache, settings)
    report.keep("NETWORK", figures.to_json())
    assert figures.wrong == []
    assert figures.late == []
