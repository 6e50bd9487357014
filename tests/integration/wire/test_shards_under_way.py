"""How many shards a reader lets be under way: what is, must fit into the sending queue of its link."""

import threading

import numpy as np
import pytest
from zenoh import Query
from zenoh.handlers import FifoChannel

from hoz_dist.wire.client import parameters
from hoz_dist.wire.client.parameters import MOST_UNDER_WAY, ParametersFollower
from hoz_dist.wire.protocol.codec import checksum, encode
from hoz_dist.wire.protocol.parameters import Parameters, ParametersDelta, ParametersHead, ParametersShard
from hoz_dist.wire.serving.editions import Full
from hoz_dist.wire.transport.queryable import reply
from hoz_dist.wire.transport.session import open_client, open_router
from hoz_dist.wire.transport.settings import router_settings
from tests.integration.wire.pushing import KEYS, WAIT_S

pytestmark = pytest.mark.integration
EDITION = Full(ParametersHead(1, 0, 6 * ParametersShard.LENGTH), np.zeros(6 * ParametersShard.LENGTH, np.float32))


def answer(query: Query) -> None:
    number = int(str(query.key_expr).rpartition("/")[2])
    payload = encode(EDITION.part(number))
    reply(query, KEYS.shard(number), payload, checksum(payload))


def test_two_are_under_way_to_a_fast_reader_and_one_to_a_slow_one(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    fetched: list[Parameters] = []
    monkeypatch.setattr(parameters, "FAST_S", WAIT_S)
    with (
        open_router(endpoint) as session,
        session.declare_queryable(KEYS.all_params, FifoChannel(16)) as asked,
        open_client(endpoint) as client,
        ParametersFollower(client, KEYS, threading.Event()) as follower,
    ):
        reading = threading.Thread(target=lambda: fetched.append(follower.fetch(timeout_s=WAIT_S)))
        reading.start()

        def under_way(wanted: int) -> list[Query]:
            """What is asked for now, and nothing more."""
            queries = [asked.recv() for _ in range(wanted)]
            assert not threading.Event().wait(0.05), "time for one more"
            assert asked.try_recv() is None
            return queries

        answer(under_way(1)[0])
        first, second = under_way(2)
        monkeypatch.setattr(parameters, "FAST_S", 0.0)
        answer(first)
        answer(second)
        answer(under_way(1)[0])
        answer(under_way(1)[0])
        answer(under_way(1)[0])
        reading.join(WAIT_S)
    assert fetched[0].head.stamp == (1, 0)


@pytest.mark.parametrize("part", [ParametersShard, ParametersDelta])
def test_those_under_way_fit_into_the_queue(part: type[ParametersShard | ParametersDelta]) -> None:
    queue = router_settings()["transport/link/tx/queue/size/data"] * 65_000  # batches, less the headers of fragments
    bulk = 4 * ParametersShard.LENGTH if part is ParametersShard else ParametersDelta.LENGTH * (1 + 4 / 256)
    assert MOST_UNDER_WAY * (bulk + 512) < queue
