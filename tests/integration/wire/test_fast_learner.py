"""A reader of deltas whose learner is always a version further, and by then has another base."""

import threading
from collections.abc import Iterator
from contextlib import closing

import numpy as np
import pytest
from zenoh import Query
from zenoh.handlers import FifoChannel

from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.protocol.codec import checksum, encode
from hoz_dist.wire.protocol.deltas import quantise
from hoz_dist.wire.protocol.parameters import NO_BASE, ParametersHead
from hoz_dist.wire.serving.editions import Delta, Full
from hoz_dist.wire.transport.publishing import NewestPublisher
from hoz_dist.wire.transport.queryable import parameters_of, reply
from hoz_dist.wire.transport.session import open_client, open_router
from tests.integration.wire.pushing import KEYS, until

pytestmark = pytest.mark.integration
SAME = np.ones(3, np.float32)
MOST_QUESTIONS = 1000


@pytest.fixture
def follower(endpoint: str) -> Iterator[ParametersFollower]:
    """A follower of a learner each of whose answers is a base that is no more the newest version."""
    stop = threading.Event()
    with (
        open_router(endpoint) as session,
        closing(NewestPublisher(session, KEYS.params)) as heads,
        open_client(endpoint) as client,
        ParametersFollower(client, KEYS, stop, deltas=True) as follower,
        session.declare_queryable(KEYS.all_params, FifoChannel(16)) as asked,
    ):

        def answer(query: Query, version: int) -> None:
            further = ParametersHead(1, version + 1, SAME.size)
            heads.publish(encode(further))
            assert until(lambda: follower.newest is not None and follower.newest.stamp == further.stamp)
            head, held = ParametersHead(1, version, SAME.size), parameters_of(query)["base"]
            base = Full(head, SAME)
            edition = base if held == NO_BASE else Delta(head, held, True, quantise(SAME, SAME))
            payload = encode(edition.part(0))
            reply(query, KEYS.shard(0), payload, checksum(payload))

        def serve() -> None:
            for number in range(MOST_QUESTIONS):
                query = asked.recv()
                if stop.is_set():
                    return
                answer(query, 2 * number)
            stop.set()

        serving = threading.Thread(target=serve)
        serving.start()
        yield follower
        assert not stop.is_set(), "it asked without end"
        stop.set()
        session.get(KEYS.shard(0))
        serving.join()


def test_what_is_late_enough_is_returned_after_at_most_one_more_round(follower: ParametersFollower) -> None:
    assert follower.fetch(timeout_s=None).head.version == 2, "the first one was a base, and a newer one was heard of"
    assert follower.fetch((1, 4), timeout_s=None).head.version <= 6


def test_a_fetch_gives_up_in_time_though_bases_come(follower: ParametersFollower) -> None:
    with pytest.raises(ConnectionFailedError, match="did not serve parameters of version 1000000"):
        follower.fetch((1, 10**6), timeout_s=0.2)
