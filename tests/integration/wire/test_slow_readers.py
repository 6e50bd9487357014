"""Readers of parameters that are slow, or stand still: nobody else waits for them."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.protocol.message import SHARD_ELEMENTS
from hoz_dist.wire.protocol.parameters import Parameters
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.transport.environment import child_environment
from hoz_dist.wire.transport.session import open_client, open_router
from tests.integration.commands import HozDist
from tests.integration.wire.pushing import KEYS, until
from tests.integration.wire.slow_link import SlowLink

pytestmark = pytest.mark.integration
SHARDS = 8
SIZE = SHARDS * SHARD_ELEMENTS - 5
LONG_S = 60.0


@contextmanager
def training(endpoint: str, *, router: bool, folder: Path) -> Iterator[ParametersPublisher]:
    """A learner that publishes a new version twenty times a second; it is the router, or a client of one."""
    stop = threading.Event()
    with ExitStack() as stack:
        if router:
            stack.enter_context(HozDist("router", "--listen", endpoint, log=folder / "router.log"))
        session = stack.enter_context(open_client(endpoint, timeout_s=30.0) if router else open_router(endpoint))
        publisher = stack.enter_context(ParametersPublisher(session, KEYS))
        publisher.publish(1, 0, np.zeros(SIZE, np.float32))

        def train() -> None:
            version = 0
            while not stop.wait(0.05):
                version += 1
                publisher.publish(1, version, np.full(SIZE, version, np.float32))

        thread = threading.Thread(target=train)
        thread.start()
        stack.callback(thread.join)
        stack.callback(stop.set)
        yield publisher


def longest_of(follower: ParametersFollower, fetches: int, seconds: float = 0.0) -> float:
    """Fetch at least so often and so long, and return how long the longest took, seconds."""
    times: list[float] = []
    end = time.monotonic() + seconds
    while len(times) < fetches or time.monotonic() < end:
        began = time.monotonic()
        fetched = follower.fetch(timeout_s=LONG_S)
        times.append(time.monotonic() - began)
        assert (fetched.vector == fetched.head.version).all()
    return max(times)


@pytest.mark.parametrize("router", [False, True], ids=["embedded", "router"])
def test_a_reader_behind_a_slow_link_gets_a_whole_version_and_holds_up_nobody(
    free_port: int, tmp_path: Path, *, router: bool
) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port}"
    with (
        training(endpoint, router=router, folder=tmp_path),
        SlowLink(free_port, bytes_per_second=1e6) as link,
        open_client(f"tcp/127.0.0.1:{link.port}", timeout_s=30.0) as slow_session,
        open_client(endpoint) as fast_session,
        ParametersFollower(slow_session, KEYS, threading.Event()) as slow,
        ParametersFollower(fast_session, KEYS, threading.Event()) as fast,
    ):
        longest_of(fast, 3)
        alone = longest_of(fast, 10)
        fetched: list[Parameters] = []
        reading = threading.Thread(target=lambda: fetched.append(slow.fetch(timeout_s=LONG_S)))
        began = time.monotonic()
        reading.start()
        beside = longest_of(fast, 20)
        assert reading.is_alive(), "it takes four seconds"
        assert beside < max(5 * alone, 0.5)
        reading.join(LONG_S)
        assert time.monotonic() - began > 3.0
        assert (fetched[0].vector == fetched[0].head.version).all()


_READER = """
import sys, threading
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.transport.session import open_client
from tests.integration.wire.pushing import KEYS
with open_client(sys.argv[1]) as session, ParametersFollower(session, KEYS, threading.Event()) as follower:
    while True:
        fetched = follower.fetch()
        assert (fetched.vector == fetched.head.version).all()
        print(fetched.head.version, flush=True)
"""


@pytest.mark.parametrize("router", [False, True], ids=["embedded", "router"])
def test_a_reader_that_stands_still_holds_up_nobody_and_goes_on(
    free_port: int, tmp_path: Path, *, router: bool
) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port}"
    with (
        training(endpoint, router=router, folder=tmp_path),
        open_client(endpoint) as session,
        ParametersFollower(session, KEYS, threading.Event()) as follower,
        subprocess.Popen(
            [sys.executable, "-c", _READER, endpoint], stdout=subprocess.PIPE, text=True, env=child_environment()
        ) as reader,
    ):
        try:
            assert reader.stdout is not None
            lines = iter(reader.stdout.readline, "")
            next(lines)
            longest_of(follower, 3)
            alone = longest_of(follower, 10)
            # Wherever in a fetch it is: it stands still a few times.
            for seconds in (0.5, 0.5, 3.0):
                os.kill(reader.pid, signal.SIGSTOP)
                assert longest_of(follower, 20, seconds) < max(5 * alone, 0.5)
                os.kill(reader.pid, signal.SIGCONT)
                next(lines)
            newest = follower.fetch(timeout_s=LONG_S).head.version
            assert until(lambda: int(next(lines)) > newest), "it goes on"
        finally:
            reader.kill()
