"""Holders of a key who want more than their role may.

Each test does the forbidden thing, then lets somebody do the same who may: what the router lets through arrives in that
order, so that the second thing proves that the first was stopped, and not merely late.
"""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
import zenoh

from hoz_dist.client import HozClient
from hoz_dist.errors import ConnectionFailedError, NotFoundError
from hoz_dist.wire.membership.liveliness import Member, Members, declare_alive
from hoz_dist.wire.protocol.codec import encode
from hoz_dist.wire.protocol.graph_messages import SceneGraphReply
from hoz_dist.wire.protocol.graphs import scene_graph_reply
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.parameters import ParametersHead
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, Push, RoomGraphPush
from hoz_dist.wire.transport.publishing import NewestPublisher, NewestSubscriber
from hoz_dist.wire.transport.session import Session
from tests import wire_samples as samples
from tests.integration.security.network import KEYS, Network
from tests.integration.wire.pushing import until

pytestmark = pytest.mark.integration

PUSHES = [
    (KEYS.grads("a0"), GradientPush),
    (KEYS.rollouts("a0"), EpisodesPush),
    (KEYS.room("a0", samples.ROOM), RoomGraphPush),
]
NOT_THE_ACTOR = ["actor-a1", "viewer-v0", "learner-l1", "withdrawn"]


def push_of(kind: type[Push]) -> Push:
    return next(message for message in samples.MESSAGES if isinstance(message, kind))


@pytest.mark.parametrize(("key", "kind"), PUSHES)
@pytest.mark.parametrize("stranger", NOT_THE_ACTOR)
def test_nobody_pushes_under_the_name_of_an_actor(network: Network, stranger: str, key: str, kind: type[Push]) -> None:
    push, before = push_of(kind), len(network.came)
    with network.open(stranger) as session:
        assert network.push(session, key, push) == []
    assert len(network.came) == before
    with network.open("actor-a0") as actor:
        assert len(network.push(actor, key, push)) == 1
    assert len(network.came) == before + 1


@pytest.mark.parametrize("mode", ["peer", "router"])
def test_who_plays_the_router_may_no_more_than_its_key_allows(network: Network, mode: str) -> None:
    key, push, before = KEYS.grads("a0"), push_of(GradientPush), len(network.came)
    with network.open_as("actor-a1", mode) as session, network.open("actor-a0") as actor:
        # Without access control it would be answered within this time as a router too.
        assert answered(network, session, within_s=1.0) is (mode == "peer")
        assert network.push(session, key, push) == []
        assert len(network.came) == before
        with answering(session, KEYS.all_grads, b"poison"), answering(session, "hoz/stolen/config", b"poison"):
            settle(network, session)
            assert payloads(actor, "hoz/stolen/config") == []
            [answer] = network.push(actor, key, push)
    assert answer.payload != b"poison"
    assert len(network.came) == before + 1


def test_an_actor_does_not_push_for_all_actors_at_once(network: Network) -> None:
    push, before = push_of(GradientPush), len(network.came)
    with network.open("actor-a0") as actor:
        assert network.push(actor, KEYS.all_grads, push) == []
        assert network.push(actor, "hoz/**", push) == []
    assert len(network.came) == before


@pytest.mark.parametrize("stranger", ["actor-a0", "viewer-v0", "withdrawn"])
def test_only_a_learner_publishes_parameters(network: Network, stranger: str) -> None:
    poison, good = (ParametersHead(9, version, 1) for version in (8, 9))
    with (
        network.open("actor-a1") as first,
        heads(first) as heard,
        network.open(stranger) as session,
        publishing(session, KEYS.params, poison),
        network.open("actor-a1") as second,
        heads(second) as heard_late,
        network.open("learner-l1") as learner,
    ):
        session.put(KEYS.params, encode(poison))
        settle(network, session)
        with publishing(learner, KEYS.params, good):
            assert until(lambda: good.version in heard and good.version in heard_late)
            assert poison.version not in heard + heard_late


@pytest.mark.parametrize("stranger", ["actor-a0", "viewer-v0", "withdrawn"])
def test_only_a_learner_publishes_graphs(network: Network, stranger: str) -> None:
    poison, good = (replace(scene_graph_reply(samples.scene_graph(), 1), version=version) for version in (98, 99))
    key = KEYS.graph("kitchen")
    with (
        network.open("actor-a1") as witness,
        graphs(witness) as heard,
        network.open(stranger) as session,
        publishing(session, key, poison),
        network.open("learner-l1") as learner,
    ):
        session.put(key, encode(poison))
        settle(network, session)
        with publishing(learner, key, good):
            assert until(lambda: good.version in heard)
            assert poison.version not in heard


@pytest.mark.parametrize("part", ["config", "params", "params/0", "graphs/kitchen", "plan/kitchen", "status"])
@pytest.mark.parametrize("stranger", ["actor-a0", "viewer-v0"])
def test_only_a_learner_answers_questions(network: Network, stranger: str, part: str) -> None:
    # On a run that nobody serves, so that the answers of the true learner are not in the way.
    key = f"hoz/stolen/{part}"
    with (
        network.open(stranger) as session,
        network.open("learner-l1") as learner,
        network.open("actor-a1") as witness,
    ):
        with answering(session, key, b"poison"):
            settle(network, session)
            assert payloads(witness, key) == []
        with answering(learner, key, b"good"):
            settle(network, learner)
            assert payloads(witness, key) == [b"good"]


def test_an_actor_does_not_receive_the_pushes_of_others(network: Network) -> None:
    push = push_of(GradientPush)
    with network.open("actor-a1") as thief, network.open("actor-a0") as actor:
        queryable = thief.declare_queryable("hoz/*/grads/*", zenoh.handlers.FifoChannel(8))
        subscriber = thief.declare_subscriber("hoz/**", zenoh.handlers.FifoChannel(8))
        settle(network, thief)
        assert len(network.push(actor, KEYS.grads("a0"), push)) == 1
        actor.put(KEYS.grads("a0"), encode(push))
        settle(network, actor)
        settle(network, thief)
        assert queryable.try_recv() is None
        assert subscriber.try_recv() is None


TOKENS = [
    ("actor-a1", Member("actor", "a0", "h", 1)),
    ("actor-a1", Member("learner", "a1", "h", 1)),
    ("actor-a1", Member("standby", "a1", "h", 1)),
    ("viewer-v0", Member("actor", "v0", "h", 1)),
    ("viewer-v0", Member("learner", "l0", "h", 1)),
    ("learner-l1", Member("learner", "l0", "h", 1)),
    ("learner-l1", Member("actor", "a0", "h", 1)),
    ("withdrawn", Member("actor", "gone", "h", 1)),
]


@pytest.mark.parametrize(("stranger", "spoofed"), TOKENS)
def test_nobody_is_alive_under_another_name(network: Network, stranger: str, spoofed: Member) -> None:
    true = Member("actor", "a0", "h", 2)
    with (
        Members(network.learner, KEYS) as members,
        network.open(stranger) as session,
        network.open("actor-a0") as actor,
        declare_alive(session, KEYS, spoofed),
    ):
        settle(network, session)
        with declare_alive(actor, KEYS, true):
            assert until(lambda: true in members.current())
            assert members.current() == (true,)
    assert spoofed not in [departure.member for departure in members.left()]


@pytest.mark.parametrize("curious", ["viewer-v0", "actor-a1", "withdrawn"])
def test_only_a_learner_sees_who_is_alive(network: Network, curious: str) -> None:
    true = Member("actor", "a0", "h", 3)
    with (
        network.open(curious) as session,
        network.open("actor-a0") as actor,
        Members(session, KEYS) as seen,
        Members(network.learner, KEYS) as members,
        declare_alive(actor, KEYS, true),
    ):
        assert until(lambda: true in members.current())
        settle(network, session)
        assert seen.current() == ()


@pytest.mark.parametrize("part", ["params", "params/0"])
def test_a_viewer_does_not_fetch_parameters(network: Network, part: str) -> None:
    network.parameters.publish(1, 1, np.zeros(3, np.float32))
    with network.open("viewer-v0") as viewer, network.open("actor-a0") as actor:
        assert network.ask(viewer, part) == []
        assert network.ask(actor, part)


@pytest.mark.parametrize("part", ["**", "*"])
def test_a_viewer_does_not_ask_for_everything_at_once(network: Network, part: str) -> None:
    with network.open("viewer-v0") as viewer:
        assert network.ask(viewer, part) == []
        assert network.ask(viewer, "graphs/**")


def test_a_withdrawn_key_gets_no_answer_and_is_told_what_that_may_mean(network: Network) -> None:
    withdrawn = network.credentials("withdrawn")
    with HozClient(network.endpoint, credentials=withdrawn) as client:
        assert client.runs() == []
        with pytest.raises(NotFoundError, match="no learner"):
            client.status()
    with HozClient(network.endpoint, KEYS.run, credentials=withdrawn) as client:
        client._keys = KEYS
        expected = f"does not answer; .* or the key in '{withdrawn.folder}' may not allow the question"
        with pytest.raises(ConnectionFailedError, match=expected):
            client.status()


def test_a_router_tells_nothing_about_itself(network: Network) -> None:
    with network.open("viewer-v0") as viewer:
        own = str(viewer.zid())
        for selector in ("@/**", "@/*/router", "**"):
            replies = viewer.get(selector, zenoh.handlers.FifoChannel(64), timeout=5.0)
            assert [reply for reply in replies if reply.ok is not None and own not in str(reply.ok.key_expr)] == []


def settle(network: Network, session: Session) -> None:
    """Wait until the router has handled what a session has sent, be it only to deny it."""
    if not network.ask(session, "config"):
        # Not even that is allowed: a key expression of our own makes the router answer that there is nobody.
        assert payloads(session, "nobody") == []


def answered(network: Network, session: Session, within_s: float) -> bool:
    """Tell whether the learner answers a session, which may have to learn first where it is."""
    end, pause = time.monotonic() + within_s, threading.Event()
    while not network.ask(session, "config"):
        if time.monotonic() > end:
            return False
        pause.wait(0.02)
    return True


@contextmanager
def heads(session: Session) -> Iterator[list[int]]:
    """Collect the versions of the parameters that a session hears of."""
    heard: list[int] = []

    def key_of(head: ParametersHead) -> str:
        heard.append(head.version)
        return KEYS.params

    with NewestSubscriber(session, KEYS.params, ParametersHead, key_of, replaces=lambda _, __: True):
        yield heard


@contextmanager
def graphs(session: Session) -> Iterator[list[int]]:
    """Collect the versions of the scene graphs that a session hears of."""
    heard: list[int] = []

    def key_of(graph: SceneGraphReply) -> str:
        heard.append(graph.version)
        return KEYS.graph(graph.scene)

    with NewestSubscriber(session, KEYS.graph("*"), SceneGraphReply, key_of, replaces=lambda _, __: True):
        yield heard


@contextmanager
def publishing(session: Session, key: str, message: Message) -> Iterator[None]:
    """Publish a message, and announce and keep it for those who come late or missed it."""
    publisher = NewestPublisher(session, key)
    publisher.publish(encode(message))
    try:
        yield
    finally:
        publisher.close()


@contextmanager
def answering(session: Session, key: str, payload: bytes) -> Iterator[None]:
    """Answer all queries on a key."""
    queryable = session.declare_queryable(key, lambda query: query.reply(key, payload))
    try:
        yield
    finally:
        queryable.undeclare()  # type: ignore[no-untyped-call]


def payloads(session: Session, selector: str) -> list[bytes]:
    """Ask, and return what is answered."""
    replies = session.get(selector, zenoh.handlers.FifoChannel(64), timeout=5.0)
    return [reply.ok.payload.to_bytes() for reply in replies if reply.ok is not None]
