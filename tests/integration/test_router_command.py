"""`hoz-dist router` as users run it."""

import signal
import socket
from pathlib import Path

import pytest

from hoz_dist.wire.transport.session import is_connected, open_client
from tests.integration.commands import HozDist, hoz_dist
from tests.waiting import until

pytestmark = pytest.mark.integration


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_says_where_it_listens_and_stops_on_a_signal(free_port: int, tmp_path: Path, number: signal.Signals) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        second_port = probe.getsockname()[1]
    endpoints = [f"tcp/127.0.0.1:{port}" for port in (free_port, second_port)]
    with HozDist("router", "--listen", endpoints[0], "--listen", endpoints[1], log=tmp_path / "log") as router:
        until(lambda: router.said != "", "a word of the router")
        assert router.said == f"Listening at {', '.join(endpoints)}.\n"
        for endpoint in endpoints:
            with open_client(endpoint) as client:
                assert is_connected(client)
        assert router.stop(number) == 0
    assert router.said.count("\n") == 1


def test_a_port_in_use_is_said_in_one_sentence(free_port: int, tmp_path: Path) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port}"
    with HozDist("router", "--listen", endpoint, log=tmp_path / "log") as first:
        until(lambda: first.said != "", "a word of the router")
        second = hoz_dist("router", "--listen", endpoint)
    assert second.returncode == 2
    assert (
        second.stderr
        == f"hoz-dist: Cannot listen at {endpoint}: it is in use; choose another endpoint with --listen.\n"
    )


def test_a_file_and_options_exclude_each_other(tmp_path: Path) -> None:
    done = hoz_dist("router", "--config", str(tmp_path / "router.json5"), "--listen", "tcp/127.0.0.1:1")
    assert done.returncode == 2
    assert "--config says everything" in done.stderr
