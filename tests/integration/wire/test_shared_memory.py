"""Payloads that go through shared memory, and when they do not."""

import logging
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
import pytest
from zenoh import Query, ZBytes
from zenoh.handlers import FifoChannel

from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.codec import encode
from hoz_dist.wire.protocol.parameters import ParametersShard, shards_of
from hoz_dist.wire.protocol.pushes import GradientPush
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport import shared_memory
from hoz_dist.wire.transport.draining import Drain
from hoz_dist.wire.transport.session import Session, open_client, open_router
from hoz_dist.wire.transport.shared_memory import LEAST_BYTES, SharedMemory
from tests import wire_samples as samples
from tests.integration.wire.pushing import GRADS, KEYS, answering
from tests.waiting import until

pytestmark = pytest.mark.integration

LARGE = bytes(range(256)) * 4000
"""About as much as a gradient of the compact preset."""
KEY = "hoz/test/bulk"


def wrapped(memory: SharedMemory, payload: bytes) -> ZBytes:
    """A payload in shared memory, or as bytes."""
    return memory.gather((payload,), len(payload)) or ZBytes(payload)


def sending(session: Session, memory: SharedMemory, payload: bytes = LARGE) -> closing[Drain[Query]]:
    """Answer each question with a payload."""

    def answer(query: Query) -> None:
        with query:
            query.reply(KEY, wrapped(memory, payload))

    return closing(Drain(session.declare_queryable(KEY, FifoChannel(4)), answer, "answers"))


def fetch(session: Session) -> tuple[bytes, bool]:
    """Ask, and return what came and whether it came through shared memory."""
    reply = next(iter(session.get(KEY, FifoChannel(4), timeout=10.0)))
    assert reply.ok is not None
    return reply.ok.payload.to_bytes(), reply.ok.payload.as_shm() is not None


@pytest.fixture
def memory() -> Iterator[SharedMemory]:
    with SharedMemory(on=True) as one:
        assert one.on
        yield one


@pytest.mark.parametrize(("router_on", "client_on"), [(True, True), (True, False), (False, True)])
def test_a_large_message_is_shared_when_both_sides_have_it_on(
    endpoint: str, memory: SharedMemory, router_on: bool, client_on: bool
) -> None:
    with (
        open_router(endpoint, shared_memory=router_on) as session,
        sending(session, memory),
        open_client(endpoint, shared_memory=client_on) as client,
    ):
        for _ in range(20):  # more than the pool holds at once
            assert fetch(client) == (LARGE, router_on and client_on)
    assert (memory.shared, memory.fallbacks) == (20, 0)


@pytest.mark.parametrize("on", [True, False])
def test_small_messages_and_those_of_who_does_not_want_it_are_plain(endpoint: str, on: bool) -> None:
    payload = bytes(LEAST_BYTES - 1) if on else LARGE
    with (
        SharedMemory(on=on) as memory,
        open_router(endpoint, shared_memory=True) as session,
        sending(session, memory, payload),
        open_client(endpoint, shared_memory=True) as client,
    ):
        assert fetch(client) == (payload, False)
        assert (memory.on, memory.shared, memory.fallbacks) == (on, 0, 0)


def test_a_pool_is_made_anew_for_larger_messages(memory: SharedMemory) -> None:
    for size in (LEAST_BYTES, 2**20, 2**20 + 1, 2**24, LEAST_BYTES):
        assert wrapped(memory, bytes(size)).as_shm() is not None
    assert (memory.shared, memory.fallbacks) == (5, 0)


def test_what_does_not_fit_goes_as_bytes_is_counted_and_said_once(
    memory: SharedMemory, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        held = [wrapped(memory, LARGE) for _ in range(10)]
        assert [message.as_shm() is not None for message in held] == [True] * 3 + [False] * 7
        assert all(message.to_bytes() == LARGE for message in held)
        held.clear()
        assert wrapped(memory, LARGE).as_shm() is not None
        memory.close()
    assert (memory.shared, memory.fallbacks) == (4, 7)
    assert [record.message for record in caplog.records] == [
        "no shared memory (the pool is full); sending bytes",
        "sending through shared memory again",
        "4 messages went through shared memory, 7 did not fit",
    ]


def test_without_room_in_the_system_there_is_none(
    memory: SharedMemory, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    wrapped(memory, LARGE)
    monkeypatch.setattr(shared_memory, "RESERVE_BYTES", 2**60)
    assert not SharedMemory(on=True).on
    assert wrapped(memory, LARGE).as_shm() is not None  # it has its pool
    assert wrapped(memory, bytes(2**24)).as_shm() is None
    assert memory.fallbacks == 1
    assert "MB of /dev/shm are needed" in caplog.text
    monkeypatch.setattr(shared_memory, "_FOLDER", Path("/dev/shm/none"))  # noqa: S108
    assert not SharedMemory(on=True).on


def test_threads_may_share_one(memory: SharedMemory) -> None:
    def work() -> None:
        for _ in range(50):
            assert wrapped(memory, LARGE).to_bytes() == LARGE

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert memory.shared + memory.fallbacks == 200


HOLDER = f"""
import sys, time
from zenoh.handlers import FifoChannel
from hoz_dist.wire.transport.session import open_client
with open_client(sys.argv[1], 10.0, shared_memory=True) as session:
    reply = session.get("{KEY}", FifoChannel(4), timeout=10.0).recv()
    print("shared" if reply.ok.payload.as_shm() is not None else "plain", flush=True)
    sys.stdin.readline()
    print(reply.ok.payload.to_bytes() == bytes(range(256)) * 4000, flush=True)
"""


@contextmanager
def holder(endpoint: str, *prefix: str) -> Iterator[tuple[Callable[[], None], str, Callable[[], str]]]:
    """A process that receives and holds a message: how to kill it, how the message came, how to let it look inside."""
    command = [*prefix, sys.executable, "-c", HOLDER, endpoint]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        how, stdin, stdout = process.stdout.readline().strip(), process.stdin, process.stdout

        def kill() -> None:
            process.kill()
            process.wait()

        def look() -> str:
            stdin.write("\n")
            stdin.flush()
            return stdout.readline().strip()

        try:
            yield kill, how, look
        finally:
            kill()


def test_a_pool_recovers_from_receivers_that_are_killed(endpoint: str, memory: SharedMemory) -> None:
    with open_router(endpoint, shared_memory=True) as session, sending(session, memory):
        for _ in range(3):
            with holder(endpoint) as (kill, how, _):
                assert how == "shared"
                kill()
        with open_client(endpoint, shared_memory=True) as client:
            # Zenoh needs a moment to notice; until then messages go as bytes.
            until(lambda: fetch(client) == (LARGE, True), "room in the pool")


def test_what_another_host_is_sent_goes_as_bytes(endpoint: str, memory: SharedMemory) -> None:
    # Zenoh finds out when it connects: the other side cannot see our memory.
    apart = ("unshare", "--mount", "sh", "-c", 'mount -t tmpfs -o size=64m tmpfs /dev/shm && exec "$@"', "sh")
    if subprocess.run([*apart, "true"], check=False, capture_output=True).returncode != 0:
        pytest.skip("may not make a mount namespace")
    with open_router(endpoint, shared_memory=True) as session, sending(session, memory):
        with holder(endpoint, *apart) as (_, how, look):
            assert how == "plain"
            assert look() == "True"
        with holder(endpoint) as (_, how, look):
            assert how == "shared"
            assert look() == "True"


def test_gradients_and_parameters_pass_through_it(endpoint: str, memory: SharedMemory) -> None:
    gradient, parameters = samples.gradient_push(0, size=300_000), np.arange(300_000, dtype=np.float32)
    snapshots = Snapshots(samples.config_reply(), samples.status_reply, "product")
    stop = threading.Event()
    with (
        SharedMemory(on=True, messages=8) as of_learner,
        open_router(endpoint, shared_memory=True) as session,
        Server(session, KEYS, snapshots) as server,
        ParametersPublisher(session, KEYS, memory=of_learner) as publisher,
        open_client(endpoint, shared_memory=True) as client,
        ParametersFollower(client, KEYS, stop) as follower,
    ):
        head = publisher.publish(1, 5, parameters)
        assert np.array_equal(follower.fetch((1, 5), timeout_s=20.0).vector, parameters)
        assert (of_learner.shared, of_learner.fallbacks) == (shards_of(head.size, ParametersShard), 0)
        pusher = Pusher(client, stop, memory=memory)
        with answering(server.inbox, lambda _: Accepted(1, 6)) as came:
            assert isinstance(pusher.push(GRADS, gradient, deadline_s=20.0), Accepted)
        assert isinstance(came[0], GradientPush)
        assert encode(came[0]) == encode(gradient)
        assert (memory.shared, memory.fallbacks) == (1, 0)
