"""Parameters and graphs on their way to those who follow them."""

import threading

import numpy as np
import pytest

from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.client.epochs import AnotherRunError
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.membership.liveliness import Members
from hoz_dist.wire.protocol.answers import Refused
from hoz_dist.wire.protocol.codec import checksum, decode
from hoz_dist.wire.protocol.graph_messages import SceneGraphReply
from hoz_dist.wire.protocol.message import SHARD_ELEMENTS
from hoz_dist.wire.protocol.parameters import ParametersDelta, ParametersHead, ParametersShard, digest_of
from hoz_dist.wire.serving.bases import LONGEST_LIFE
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.serving.versions import Versions
from hoz_dist.wire.transport.ask import ask
from hoz_dist.wire.transport.publishing import NewestSubscriber
from hoz_dist.wire.transport.session import Session, open_client, open_router
from tests import wire_samples as samples
from tests.integration.wire.pushing import KEYS, WAIT_S, until

pytestmark = pytest.mark.integration


def test_graphs_are_served_from_the_first_question_on(endpoint: str) -> None:
    snapshots = Snapshots(samples.config_reply(), samples.status_reply, "product")
    with open_router(endpoint) as session, Server(session, KEYS, snapshots, graphs=[samples.scene_graph()]):
        assert set(snapshots.graphs) == {"kitchen"}
        with open_client(endpoint) as client:
            (answer,) = ask(client, KEYS.graph("kitchen"), timeout_s=5.0)
            assert decode(answer.payload, SceneGraphReply).version == 2


def test_parameters_that_suffice_and_are_the_newest_are_not_fetched_again(learner: Server, client: Session) -> None:
    with ParametersFollower(client, KEYS, threading.Event()) as follower:
        with ParametersPublisher(learner.session, KEYS) as publisher:
            publisher.publish(1, 4, np.ones(3, np.float32))
            fetched = follower.fetch(timeout_s=WAIT_S)
            assert until(lambda: follower.newest is not None)
        # Nobody serves them any more.
        assert follower.fetch((1, 4), timeout_s=0.2) is fetched
        for at_least in (None, (1, 5)):
            with pytest.raises(ConnectionFailedError):
                follower.fetch(at_least, timeout_s=0.2)


def test_a_follower_gets_the_newest_parameters(learner: Server, client: Session, endpoint: str) -> None:
    vector = np.arange(1000, dtype=np.float32)
    with (
        ParametersFollower(client, KEYS, threading.Event()) as early,
        ParametersPublisher(learner.session, KEYS) as publisher,
    ):
        publisher.publish(1, 0, vector)
        first = early.fetch(timeout_s=WAIT_S)
        assert first.head.stamp == (1, 0)
        np.testing.assert_array_equal(first.vector, np.arange(1000))
        vector += 1  # the learner's own array goes on, what it published does not
        np.testing.assert_array_equal(early.fetch(timeout_s=WAIT_S).vector, np.arange(1000))
        head = publisher.publish(1, 1, vector)
        assert until(lambda: early.newest is not None and early.newest.stamp == (1, 1))
        np.testing.assert_array_equal(early.fetch((1, 1), WAIT_S).vector, np.arange(1000) + 1)
        with open_client(endpoint) as other, ParametersFollower(other, KEYS, threading.Event()) as late:
            assert until(lambda: late.newest is not None and late.newest.stamp == head.stamp), "late joiners know"
        (answer,) = ask(client, KEYS.params, timeout_s=5.0)
        assert decode(answer.payload, ParametersHead).stamp == head.stamp


@pytest.mark.parametrize("deltas", [False, True], ids=["full", "deltas"])
def test_parameters_of_several_shards_are_never_mixed(learner: Server, client: Session, deltas: bool) -> None:
    stop = threading.Event()
    size = 4 * SHARD_ELEMENTS + 5
    with (
        ParametersFollower(client, KEYS, threading.Event(), deltas=deltas) as follower,
        ParametersPublisher(learner.session, KEYS) as publisher,
    ):
        publisher.publish(1, 0, np.zeros(size, np.float32))

        def train() -> None:
            version = 0
            while not stop.is_set():
                version += 1
                publisher.publish(1, version, np.full(size, version, np.float32))

        thread = threading.Thread(target=train)
        thread.start()
        stamps = []
        for _ in range(8):
            fetched = follower.fetch(timeout_s=WAIT_S)
            stamps.append(fetched.head.stamp)
            assert (fetched.vector == fetched.vector[0]).all()
            # A delta of so many whole steps may be off by their rounding.
            assert fetched.vector[0] == pytest.approx(fetched.head.version, rel=1e-5 if deltas else 0.0)
        stop.set()
        thread.join(WAIT_S)
    assert stamps == sorted(stamps)


def test_a_reader_of_deltas_gets_a_base_in_full_and_then_a_byte_for_each_parameter(
    learner: Server, client: Session
) -> None:
    rng = np.random.default_rng(5)
    vector = rng.normal(size=1000).astype(np.float32)
    with (
        ParametersPublisher(learner.session, KEYS) as publisher,
        ParametersFollower(client, KEYS, threading.Event(), deltas=True) as follower,
    ):
        publisher.publish(1, 0, vector)
        np.testing.assert_array_equal(follower.fetch(timeout_s=WAIT_S).vector, vector)
        base = digest_of(vector)
        (same,) = ask(client, f"{KEYS.shard(0)}?reader=a;base={base}", timeout_s=5.0)
        assert decode(same.payload, ParametersHead).stamp == (1, 0), "what it has is the newest"
        for version in range(1, 3 * LONGEST_LIFE, 100):
            vector = vector + rng.normal(scale=1e-3, size=1000).astype(np.float32)
            publisher.publish(1, version, vector)
            fetched = follower.fetch((1, version), WAIT_S)
            assert fetched.head.version == version
            np.testing.assert_allclose(fetched.vector, vector, atol=1e-4)
        with ParametersFollower(client, KEYS, threading.Event(), deltas=True) as late:
            assert late.fetch((1, version), WAIT_S).head.version == version, "though the base is older"
        # Who has the first base, or none, gets the one of now.
        for held in (base, "none"):
            (answer,) = ask(client, f"{KEYS.shard(0)}?reader=b;base={held}", timeout_s=5.0)
            now = decode(answer.payload, ParametersShard)
        (answer,) = ask(client, f"{KEYS.shard(0)}?reader=b;base={digest_of(now.values)}", timeout_s=5.0)
        delta = decode(answer.payload, ParametersDelta)
        assert delta.head.version == version
        assert len(answer.payload) < 1.5 * vector.size
        assert answer.checksum == checksum(answer.payload)


def test_a_reader_of_deltas_goes_on_with_the_learner_of_another_epoch(endpoint: str) -> None:
    vector = np.linspace(-1, 1, 1000, dtype=np.float32)
    with (
        open_router(endpoint) as session,
        open_client(endpoint) as client,
        ParametersFollower(client, KEYS, threading.Event(), deltas=True) as follower,
    ):
        # The new learner begins with what the old one had a version before, which is the reader's base.
        for epoch, first in ((1, 5), (2, 5)):
            with ParametersPublisher(session, KEYS) as publisher:
                for version in (first, first + 1):
                    publisher.publish(epoch, version, vector + np.float32(version))
                    fetched = follower.fetch((epoch, version), WAIT_S)
                    assert fetched.head.stamp == (epoch, version)
                    np.testing.assert_allclose(fetched.vector, vector + version, atol=1e-2)


@pytest.mark.parametrize("base", ["", "NONE", "0123456789abcde", "0123456789ABCDEF"])
def test_a_base_that_cannot_be_one_is_refused(learner: Server, client: Session, base: str) -> None:
    with ParametersPublisher(learner.session, KEYS, learner.rejections) as publisher:
        publisher.publish(1, 0, np.zeros(3, np.float32))
        (answer,) = ask(client, f"{KEYS.shard(0)}?reader=a;base={base}", timeout_s=5.0)
        assert decode(answer.payload, Refused).reason == "name"


def test_who_does_not_begin_with_the_first_shard_is_refused_and_nothing_is_kept(
    learner: Server, client: Session
) -> None:
    versions = Versions()
    with ParametersPublisher(learner.session, KEYS, learner.rejections, versions) as publisher:
        publisher.publish(1, 0, np.zeros(2 * SHARD_ELEMENTS, np.float32))
        for question in ("1?reader=a", "7?reader=b", "2?reader=c;epoch=1;version=0"):
            (answer,) = ask(client, f"{KEYS.params}/{question}", timeout_s=5.0)
            assert decode(answer.payload, Refused).reason == "range"
        vector = np.ones(2 * SHARD_ELEMENTS, np.float32)
        publisher.publish(1, 1, vector)
        assert versions.kept_bytes() == vector.nbytes
    assert learner.rejections.by_reason() == {"range": 3}


def test_a_shard_that_was_lost_is_asked_for_once_more_though_the_last_one_was_under_way(
    learner: Server, client: Session
) -> None:
    with ParametersPublisher(learner.session, KEYS) as publisher:
        publisher.publish(1, 0, np.zeros(3 * SHARD_ELEMENTS, np.float32))
        for number in (0, 1, 2):
            ask(client, f"{KEYS.shard(number)}?reader=a" + (";epoch=1;version=0" if number else ""), timeout_s=5.0)
        publisher.publish(1, 1, np.ones(3 * SHARD_ELEMENTS, np.float32))
        (answer,) = ask(client, f"{KEYS.shard(1)}?reader=a;epoch=1;version=0", timeout_s=5.0)
        assert decode(answer.payload, ParametersShard).head.version == 0


def test_parameters_never_run_backwards_but_a_new_epoch_may_begin_lower(learner: Server, client: Session) -> None:
    with (
        ParametersFollower(client, KEYS, threading.Event()) as follower,
        ParametersPublisher(learner.session, KEYS) as publisher,
    ):
        publisher.publish(2, 9, np.ones(3, np.float32))
        assert follower.fetch(timeout_s=WAIT_S).head.stamp == (2, 9)
        publisher.publish(1, 50, np.zeros(3, np.float32))
        with pytest.raises(ConnectionFailedError, match="did not serve parameters of version 9 or later"):
            follower.fetch(timeout_s=0.2)
        publisher.publish(2, 8, np.zeros(3, np.float32))
        with pytest.raises(AnotherRunError, match="serves version 8 of epoch 2 and has served version 9"):
            follower.fetch(timeout_s=0.2)
        assert follower.newest is not None
        assert follower.newest.stamp == (2, 9)
        publisher.publish(3, 4, np.full(3, 7, np.float32))
        assert follower.fetch(timeout_s=WAIT_S).head.stamp == (3, 4)


def test_a_follower_hears_of_the_new_epoch_of_a_restarted_learner(endpoint: str) -> None:
    with samples.serving(endpoint) as (_, session), ParametersPublisher(session, KEYS) as publisher:
        client = open_client(endpoint)
        follower = ParametersFollower(client, KEYS, threading.Event())
        publisher.publish(1, 7, np.zeros(3, np.float32))
        assert until(lambda: follower.newest is not None)
    with client, follower, samples.serving(endpoint) as (_, session), ParametersPublisher(session, KEYS) as publisher:
        publisher.publish(2, 3, np.ones(3, np.float32))
        assert until(lambda: follower.newest is not None and follower.newest.stamp == (2, 3))
        np.testing.assert_array_equal(follower.fetch((2, 0), WAIT_S).vector, np.ones(3))


def following_graphs(session: Session) -> NewestSubscriber[SceneGraphReply]:
    return NewestSubscriber(
        session,
        KEYS.graph("*"),
        SceneGraphReply,
        key_of=lambda graph: KEYS.graph(graph.scene),
        replaces=lambda known, new: (new.epoch, new.version) > (known.epoch, known.version),
    )


def test_graphs_are_published_when_they_change(learner: Server, client: Session) -> None:
    with following_graphs(client) as graphs:
        learner.put_graph(samples.scene_graph(version=1))
        learner.put_graph(samples.room_graph())
        key = KEYS.graph("kitchen")
        assert graphs.wait_for(lambda newest: key in newest, WAIT_S)
        learner.put_graph(samples.scene_graph(version=2))
        assert graphs.wait_for(lambda newest: newest[key].version == 2, WAIT_S)
        assert set(graphs.newest) == {key}, "room graphs have keys of their own"
        with following_graphs(client) as late:
            assert late.wait_for(lambda newest: key in newest and newest[key].version == 2, WAIT_S)


def test_no_thread_and_no_session_is_left_behind(endpoint: str) -> None:
    before = set(threading.enumerate())
    with samples.serving(endpoint) as (server, session), open_client(endpoint) as client:
        with (
            ParametersPublisher(session, KEYS) as publisher,
            ParametersFollower(client, KEYS, threading.Event()) as follower,
            Members(session, KEYS),
        ):
            publisher.publish(1, 0, np.zeros(3, np.float32))
            follower.fetch(timeout_s=WAIT_S)
        server.put_graph(samples.scene_graph())
    assert session.is_closed()
    assert client.is_closed()
    assert set(threading.enumerate()) == before
