"""Opening sessions, and what is said when that fails."""

import os
import signal
import subprocess
import sys
import threading
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest
import zenoh

from hoz_dist.errors import ConnectionFailedError, DamagedFileError, HozError, InvalidValueError, NotFoundError
from hoz_dist.waiting import StoppedError
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.transport.credentials import Credentials
from hoz_dist.wire.transport.session import is_connected, open_client, open_configured_router, open_router
from hoz_dist.wire.transport.settings import SERVICE_LEASE_MS
from tests import wire_samples as samples
from tests.integration.commands import HozDist
from tests.integration.wire.pushing import WAIT_S, until

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


def test_a_client_knows_whether_it_has_a_router(endpoint: str) -> None:
    with open_router(endpoint) as router, open_client(endpoint) as client:
        assert is_connected(client)
        router.close()  # type: ignore[no-untyped-call]
        assert until(lambda: not is_connected(client))
        with open_router(endpoint):
            assert until(lambda: is_connected(client))


def test_a_router_that_stands_still_is_noticed_within_its_lease(endpoint: str, tmp_path: Path) -> None:
    with HozDist("router", "--listen", endpoint, log=tmp_path / "log") as router:
        assert until(lambda: "Listening" in router.said)
        with open_client(endpoint) as client:
            router.process.send_signal(signal.SIGSTOP)
            began = time.monotonic()
            assert until(lambda: not is_connected(client))
            assert time.monotonic() - began < SERVICE_LEASE_MS / 1000 + 1.0
            router.process.send_signal(signal.SIGCONT)
            assert until(lambda: is_connected(client))


_STALLED = """
import sys
from hoz_dist.wire.transport.session import open_client
with open_client(sys.argv[1]) as session:
    replies = session.get("big")
    print("asked", flush=True)
    sys.stdin.read()
"""


def test_a_client_that_stands_still_does_not_hold_up_the_others(endpoint: str, tmp_path: Path) -> None:
    """With 16 MB on the way to it: more than queues and sockets hold, so that the router must wait for it."""
    with (
        HozDist("router", "--listen", endpoint, log=tmp_path / "log") as router,
        open_client(endpoint, WAIT_S, lease_ms=SERVICE_LEASE_MS) as learner,
        open_client(endpoint, WAIT_S) as other,
        subprocess.Popen(
            [sys.executable, "-c", _STALLED, endpoint], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as stalled,
    ):
        stopped = threading.Event()

        def serve(query: zenoh.Query) -> None:
            if str(query.key_expr) == "big":
                os.kill(stalled.pid, signal.SIGSTOP)
                stopped.set()
            with query:
                query.reply(str(query.key_expr), bytes(16_000_000 if str(query.key_expr) == "big" else 8))

        queryables = [learner.declare_queryable(key, serve) for key in ("big", "small")]
        try:
            assert stopped.wait(WAIT_S)
            longest, end = 0.0, time.monotonic() + 5.0
            while time.monotonic() < end:
                asked = time.monotonic()
                answers = [reply.ok for reply in other.get("small", timeout=WAIT_S)]
                assert len(answers) == 1, "the learner was given up"
                longest = max(longest, time.monotonic() - asked)
            assert 1.0 < longest < 4.0  # 6.5 s with Zenoh's own patience, and the learner is given up meanwhile
            assert router.runs
        finally:
            for queryable in queryables:
                queryable.undeclare()  # type: ignore[no-untyped-call]
            stalled.kill()


def test_keys_and_encryption_go_together(endpoint: str, tmp_path: Path) -> None:
    credentials = Credentials("router", "r0", tmp_path, datetime.now(UTC))
    encrypted = endpoint.replace("tcp/", "tls/")
    for opener in (open_client, open_router):
        with pytest.raises(InvalidValueError, match=f"'{encrypted}' is encrypted and needs keys: add --keys FOLDER"):
            opener(encrypted)
        expected = f"'{endpoint}' is not encrypted, so that keys protect nothing there: use {encrypted}"
        with pytest.raises(InvalidValueError, match=expected):
            opener(endpoint, credentials=credentials)


def test_a_router_without_its_access_control_does_not_open(endpoint: str, tmp_path: Path) -> None:
    credentials = Credentials("router", "r0", tmp_path, datetime.now(UTC))
    with pytest.raises(NotFoundError, match=r"no router configuration '.*router\.json5'; `hoz-dist keys issue router"):
        open_router(endpoint.replace("tcp/", "tls/"), credentials)


def test_a_router_opens_from_a_file(endpoint: str, tmp_path: Path) -> None:
    file = tmp_path / "router.json5"
    file.write_text(f'{{mode: "router", listen: {{endpoints: ["{endpoint}"]}}, /* JSON5 */ }}')
    with open_configured_router(file), open_client(endpoint) as client:
        assert is_connected(client)
        with pytest.raises(ConnectionFailedError, match=f"Cannot listen at the endpoints in '{file}': it is in use"):
            open_configured_router(file)


@pytest.mark.parametrize(
    ("content", "error", "said"),
    [
        (None, NotFoundError, "There is no router configuration"),
        ("{mode: ", DamagedFileError, "is no configuration of Zenoh"),
        ('{mode: "router", colour: "red"}', DamagedFileError, "is no configuration of Zenoh"),
        ('{mode: "peer"}', InvalidValueError, "does not configure a router"),
        ("{}", InvalidValueError, "does not configure a router"),
    ],
)
def test_what_is_no_router_file_is_said_in_one_sentence(
    tmp_path: Path, content: str | None, error: type[HozError], said: str
) -> None:
    file = tmp_path / "router.json5"
    if content is not None:
        file.write_text(content)
    with pytest.raises(error, match=said) as caught:
        open_configured_router(file)
    assert ".rs" not in str(caught.value)
    assert "\n" not in str(caught.value)
