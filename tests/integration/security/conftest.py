"""Routers with access control, one of each kind for all tests of a module."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.integration.security.network import ROUTERS, Network, issue_all, running


@pytest.fixture(scope="module", params=ROUTERS)
def network(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Network]:
    folder: Path = tmp_path_factory.mktemp("authority") / "keys"
    endpoint = issue_all(folder)[request.param]
    with running(request.param, folder, endpoint, folder / "router.log") as started:
        yield started
