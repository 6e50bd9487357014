"""A learner's session that is the router, and a client of it."""

from collections.abc import Iterator

import pytest

from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.transport.session import Session, open_client
from tests import wire_samples as samples


@pytest.fixture
def endpoint(free_port: int) -> str:
    return f"tcp/127.0.0.1:{free_port}"


@pytest.fixture
def learner(endpoint: str) -> Iterator[Server]:
    with samples.serving(endpoint) as (server, _):
        yield server


@pytest.fixture
def client(learner: Server, endpoint: str) -> Iterator[Session]:
    with open_client(endpoint) as session:
        yield session
