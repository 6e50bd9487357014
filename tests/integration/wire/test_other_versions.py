"""Peers of another protocol version are told so, and told apart from silence."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import msgpack
import pytest
import zenoh

from hoz_dist.client import HozClient
from hoz_dist.wire.client.discovery import find_run
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.protocol.answers import Refused
from hoz_dist.wire.protocol.codec import decode, encode
from hoz_dist.wire.protocol.rejection import OtherVersionError
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.transport.queryable import declare_queryable
from hoz_dist.wire.transport.session import Session, open_client, open_router
from tests import wire_samples as samples
from tests.integration.wire.pushing import GRADS, KEYS, WAIT_S, raw_push
from tests.mutations import split

pytestmark = pytest.mark.integration
SENTENCE = r"^The other side speaks protocol version 9; this side speaks 2: run the same release of hoz-dist on both\.$"


@contextmanager
def strange_learner(endpoint: str) -> Iterator[Session]:
    """A client of a learner that answers everything in version 9, of whose messages only ``v`` is known."""
    strange: bytes = msgpack.packb({"v": 9, "novelty": [msgpack.ExtType(3, b"x")]})

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(str(query.key_expr).replace("*", KEYS.run), strange)

    with open_router(endpoint) as session:
        queryable = declare_queryable(session, f"hoz/{KEYS.run}/**", answer)
        with open_client(endpoint) as client:
            yield client
        queryable.close()


def test_an_actor_of_another_version_is_refused_by_that_name(learner: Server, client: Session) -> None:
    fields, _ = split(encode(samples.gradient_push()))
    for payload in (msgpack.packb(fields | {"v": 1}), msgpack.packb({"v": 1, "novelty": msgpack.ExtType(3, b"x")})):
        (answer,) = raw_push(client, GRADS, payload)
        refused = decode(answer, Refused)
        assert (refused.reason, refused.detail) == (
            "version",
            "the message is of protocol version 1; this side speaks 2",
        )
    assert learner.rejections.by_reason() == {"version": 2}


def test_whoever_asks_or_pushes_says_so_in_one_sentence(endpoint: str) -> None:
    stop = threading.Event()
    with strange_learner(endpoint) as session:
        with pytest.raises(OtherVersionError, match=SENTENCE):
            find_run(session, None)
        with HozClient(endpoint, KEYS.run) as client, pytest.raises(OtherVersionError, match=SENTENCE):
            client.status()
        with pytest.raises(OtherVersionError, match=SENTENCE):
            Pusher(session, stop).push(GRADS, samples.gradient_push(), WAIT_S)
        with ParametersFollower(session, KEYS, stop) as follower, pytest.raises(OtherVersionError, match=SENTENCE):
            follower.fetch(timeout_s=WAIT_S)
