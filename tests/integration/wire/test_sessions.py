"""Opening sessions, and what is said when that fails."""

import threading
import time

import pytest

from hoz_dist.errors import ConnectionFailedError, InvalidValueError
from hoz_dist.wire.server import Server
from hoz_dist.wire.session import open_client, open_router
from hoz_dist.wire.waiting import StoppedError
from tests import wire_samples as samples
from tests.integration.wire.pushing import WAIT_S

pytestmark = pytest.mark.integration


def test_an_endpoint_where_nobody_answers_is_said_in_one_sentence(endpoint: str) -> None:
    began = time.monotonic()
    with pytest.raises(ConnectionFailedError, match=f"No learner or router answers at {endpoint}; start one"):
        open_client(endpoint)
    assert time.monotonic() - began < 3.0


def test_a_port_in_use_is_said_in_one_sentence(learner: Server, endpoint: str) -> None:
    with pytest.raises(ConnectionFailedError, match=f"Cannot listen at {endpoint}: it is in use"):
        open_router(endpoint)


def test_an_address_of_another_machine_is_said_in_one_sentence() -> None:
    with pytest.raises(ConnectionFailedError, match="does not belong to this machine"):
        open_router("tcp/192.0.2.1:7447")


def test_another_failure_to_listen_is_said_in_zenohs_own_words() -> None:
    with pytest.raises(ConnectionFailedError) as caught:
        open_router("tcp/no-such-host.invalid:7447")
    assert "failed to lookup address information" in str(caught.value)
    assert ".rs" not in str(caught.value)


def test_a_client_waits_for_a_router_for_as_long_as_it_was_told(endpoint: str) -> None:
    opened = []
    waiting = threading.Thread(target=lambda: opened.append(open_client(endpoint, timeout_s=WAIT_S)))
    waiting.start()
    with pytest.raises(ConnectionFailedError):
        open_client(endpoint, timeout_s=2.5)
    with samples.serving(endpoint):
        waiting.join(WAIT_S)
        with opened[0] as session:
            assert not session.is_closed()


def test_a_stopped_process_does_not_wait_for_a_router(endpoint: str) -> None:
    stop = threading.Event()
    stop.set()
    with pytest.raises(StoppedError):
        open_client(endpoint, timeout_s=60.0, stop=stop)


def test_a_malformed_endpoint_is_said_in_one_sentence() -> None:
    for opener in (open_client, open_router):
        with pytest.raises(InvalidValueError, match=r"'127\.0\.0\.1:7447' is not an endpoint"):
            opener("127.0.0.1:7447")
