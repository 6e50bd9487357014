"""The wire over real Zenoh sessions: a learner's session that is the router, and its clients."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
import zenoh

from hoz_dist.errors import ConnectionFailedError, InvalidValueError
from hoz_dist.wire.ask import ask
from hoz_dist.wire.codec import checksum, decode, encode
from hoz_dist.wire.inbox import Inbox, Request
from hoz_dist.wire.liveliness import Member, Members, declare_alive
from hoz_dist.wire.messages import (
    Accepted,
    Busy,
    ParametersHead,
    Push,
    PushReply,
    Refused,
    SceneGraphReply,
)
from hoz_dist.wire.parameters import SHARD_ELEMENTS, ParametersFollower, ParametersPublisher
from hoz_dist.wire.publishing import NewestSubscriber
from hoz_dist.wire.push import Pusher
from hoz_dist.wire.rejection import Reason
from hoz_dist.wire.server import Server
from hoz_dist.wire.session import Session, open_client, open_router
from hoz_dist.wire.snapshots import Snapshots
from hoz_dist.wire.waiting import StoppedError
from tests import wire_samples as samples

pytestmark = pytest.mark.integration
KEYS = samples.KEYS
GRADS = KEYS.grads("a0")
WAIT_S = 10.0


@pytest.fixture
def endpoint(free_port: int) -> str:
    return f"tcp/127.0.0.1:{free_port}"


@pytest.fixture
def learner(endpoint: str) -> Iterator[Server]:
    with samples.serving(endpoint) as (server, _):
        yield server


@pytest.fixture
def client(learner: Server, endpoint: str) -> Iterator[Session]:
    with open_client(endpoint) as session:
        yield session


@contextmanager
def answering(inbox: Inbox, decide: Callable[[Push], PushReply]) -> Iterator[list[Push]]:
    """Take pushes out of an inbox and answer them in a thread, as a learner does; gives what came."""
    stop = threading.Event()
    came: list[Push] = []

    def work() -> None:
        while not stop.is_set():
            request = inbox.take(0.01)
            if request is not None:
                came.append(request.message)
                request.answer(decide(request.message))

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield came
    finally:
        stop.set()
        thread.join()


def until(condition: Callable[[], bool]) -> bool:
    """Wait until something is true; False when it does not come true in time."""
    end, pause = time.monotonic() + WAIT_S, threading.Event()
    while not condition():
        if time.monotonic() > end:
            return False
        pause.wait(0.01)
    return True


def push_to(session: Session, push: Push, key: str = GRADS) -> PushReply:
    return Pusher(session, threading.Event()).push(key, push, deadline_s=WAIT_S)


def taken(inbox: Inbox) -> Request:
    request = inbox.take(WAIT_S)
    assert request is not None
    return request


# --- sessions ---


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


# --- pushes ---


def test_a_push_arrives_and_is_acknowledged(learner: Server, client: Session) -> None:
    push = samples.gradient_push()
    with answering(learner.inbox, lambda _: Accepted(1, 6)) as came:
        reply = push_to(client, push)
    assert isinstance(reply, Accepted)
    assert (reply.epoch, reply.version) == (1, 6)
    assert len(came) == 1
    assert encode(came[0]) == encode(push)


def test_a_busy_learner_is_asked_again_until_it_takes_the_push(learner: Server, client: Session) -> None:
    replies: Iterator[PushReply] = iter([Busy(), Busy(), Accepted(1, 6)])
    with answering(learner.inbox, lambda _: next(replies)) as came:
        assert isinstance(push_to(client, samples.gradient_push(3)), Accepted)
    assert [push.sequence for push in came] == [3, 3, 3]


def test_a_refused_push_is_counted_and_not_repeated(learner: Server, client: Session) -> None:
    with answering(learner.inbox, lambda _: Refused(Reason.STALE, "too old")) as came:
        reply = push_to(client, samples.gradient_push())
    assert isinstance(reply, Refused)
    assert (reply.reason, reply.detail) == ("stale", "too old")
    assert len(came) == 1
    assert learner.rejections.by_reason() == {"stale": 1}
    assert learner.rejections.by_sender() == {"a0": 1}


def test_the_end_of_a_run_is_no_rejection(learner: Server, client: Session) -> None:
    with answering(learner.inbox, lambda _: Refused(Reason.FINISHED, "the budget is used up")):
        assert isinstance(push_to(client, samples.gradient_push()), Refused)
    assert learner.rejections.by_reason() == {}


def test_an_unanswered_push_is_sent_again_with_the_same_identity(learner: Server, client: Session) -> None:
    push = samples.gradient_push(sequence=8)
    replies: list[PushReply] = []
    pusher = Pusher(client, threading.Event(), attempt_s=0.2)
    thread = threading.Thread(target=lambda: replies.append(pusher.push(GRADS, push)))
    thread.start()
    first = taken(learner.inbox)  # held: the learner computes for longer than an attempt lasts
    second = taken(learner.inbox)
    first.answer(Accepted(1, 6))  # too late, nobody listens
    second.answer(Accepted(1, 6))
    thread.join(WAIT_S)
    assert isinstance(replies[0], Accepted)
    identities = {(p.message.actor, p.message.incarnation, p.message.sequence) for p in (first, second)}
    assert identities == {("a0", 77, 8)}


def test_a_request_can_be_answered_once_only(learner: Server, client: Session) -> None:
    with answering(learner.inbox, lambda _: Accepted(1, 1)):
        push_to(client, samples.gradient_push())
    answers = []
    thread = threading.Thread(target=lambda: answers.extend(_raw_push(client, GRADS, encode(samples.gradient_push()))))
    thread.start()
    request = taken(learner.inbox)
    request.answer(Accepted(1, 2))
    request.answer(Refused(Reason.STALE, "again"))
    thread.join(WAIT_S)
    assert [decode(answer, Accepted).version for answer in answers] == [2]
    assert learner.rejections.by_reason() == {}


def test_a_stopped_process_does_not_wait_for_its_push(learner: Server, client: Session) -> None:
    stop = threading.Event()
    caught: list[BaseException] = []

    def push() -> None:
        try:
            Pusher(client, stop).push(GRADS, samples.gradient_push())
        except StoppedError as error:
            caught.append(error)

    thread = threading.Thread(target=push)
    thread.start()
    taken(learner.inbox)
    began = time.monotonic()
    stop.set()
    thread.join(WAIT_S)
    assert caught
    assert time.monotonic() - began < 0.5


def test_a_push_gives_up_at_its_deadline(learner: Server, client: Session) -> None:
    with answering(learner.inbox, lambda _: Busy()), pytest.raises(ConnectionFailedError, match=r"within 0\.3 s"):
        Pusher(client, threading.Event()).push(GRADS, samples.gradient_push(), deadline_s=0.3)


def test_a_full_inbox_makes_the_learner_busy_at_once(endpoint: str) -> None:
    inbox = Inbox(most=2)
    with samples.serving(endpoint) as (server, _), open_client(endpoint) as session:
        server.inbox = inbox
        waiting = [threading.Thread(target=_raw_push, args=(session, GRADS, _encoded(n))) for n in range(2)]
        for thread in waiting:
            thread.start()
        assert until(lambda: len(inbox) == 2)
        (answer,) = _raw_push(session, GRADS, _encoded(2))
        assert isinstance(decode(answer, Busy), Busy)
        for _ in range(2):
            taken(inbox).answer(Accepted(1, 1))
        for thread in waiting:
            thread.join(WAIT_S)
    assert server.rejections.by_reason() == {}


def test_an_inbox_is_bounded_by_bytes_too(endpoint: str) -> None:
    inbox = Inbox(most_bytes=1000)
    with samples.serving(endpoint) as (server, _), open_client(endpoint) as session:
        server.inbox = inbox
        first = threading.Thread(target=_raw_push, args=(session, GRADS, _encoded(0, size=2000)))
        first.start()
        assert until(lambda: len(inbox) == 1), "one message may always wait, however long"
        (answer,) = _raw_push(session, GRADS, _encoded(1, size=10))
        assert isinstance(decode(answer, Busy), Busy)
        taken(inbox).answer(Accepted(1, 1))
        first.join(WAIT_S)
        with answering(inbox, lambda _: Accepted(1, 1)):
            for sequence in range(10):  # together more than may wait; what was taken out makes room
                assert isinstance(push_to(session, samples.gradient_push(sequence)), Accepted)
        small = [threading.Thread(target=_raw_push, args=(session, GRADS, _encoded(n, size=10))) for n in range(2)]
        for thread in small:
            thread.start()
        assert until(lambda: len(inbox) == 2)
        for _ in small:
            taken(inbox).answer(Accepted(1, 1))
        for thread in small:
            thread.join(WAIT_S)


# --- hostile pushes ---


def _encoded(sequence: int, size: int = 100) -> bytes:
    return encode(samples.gradient_push(sequence, size=size))


def _raw_push(session: Session, key: str, payload: bytes, attachment: bytes | None = None) -> list[bytes]:
    sum_of = checksum(payload) if attachment is None else attachment
    return [answer.payload for answer in ask(session, key, timeout_s=5.0, payload=payload, attachment=sum_of)]


@pytest.mark.parametrize(
    ("key", "payload", "attachment", "reason"),
    [
        (GRADS, b"", None, "malformed"),
        (GRADS, b"\x00\xff", None, "malformed"),
        (GRADS, _encoded(0), b"12345678", "checksum"),
        (GRADS, _encoded(0), b"", "checksum"),
        (GRADS, encode(samples.MESSAGES[1]), None, "kind"),
        (KEYS.grads("a1"), _encoded(0), None, "identity"),
        (KEYS.rollouts("a1"), encode(samples.MESSAGES[1]), None, "identity"),
        (f"hoz/{KEYS.run}/rooms/kitchen/4", encode(samples.MESSAGES[2]), None, "identity"),
        (KEYS.all_grads, _encoded(0), None, "identity"),
    ],
)
def test_a_bad_push_gets_one_answer_with_its_reason_and_is_counted(
    learner: Server, client: Session, key: str, payload: bytes, attachment: bytes | None, reason: str
) -> None:
    (answer,) = _raw_push(client, key, payload, attachment)
    assert decode(answer, Refused).reason == reason
    assert learner.rejections.by_reason() == {reason: 1}
    assert learner.inbox.take(0) is None


def test_a_bad_push_of_a_room_is_counted_by_its_whole_key(learner: Server, client: Session) -> None:
    key = KEYS.room(samples.ROOM)
    _raw_push(client, key, b"")
    assert learner.rejections.by_sender() == {key: 1}


def test_a_push_damaged_on_the_way_is_sent_again(learner: Server, client: Session, endpoint: str) -> None:
    # A relay that damages the first message stands in for the network.
    relay_keys = "relay/grads"
    damage = iter([b"12345678"])
    with open_client(endpoint) as relay:
        queryable = relay.declare_queryable(relay_keys, zenoh.handlers.FifoChannel(4))

        def work() -> None:
            for query in queryable.handler:
                with query:
                    assert query.payload is not None
                    assert query.attachment is not None
                    payload = query.payload.to_bytes()
                    attachment = next(damage, query.attachment.to_bytes())
                    (answer,) = ask(relay, GRADS, timeout_s=5.0, payload=payload, attachment=attachment)
                    if answer.key:
                        query.reply(relay_keys, answer.payload)
                    else:
                        query.reply_err(answer.payload)

        thread = threading.Thread(target=work)
        thread.start()
        with answering(learner.inbox, lambda _: Accepted(1, 1)) as came:
            reply = push_to(client, samples.gradient_push(), relay_keys)
        queryable.undeclare()  # type: ignore[no-untyped-call]
        thread.join(WAIT_S)
    assert isinstance(reply, Accepted)
    assert len(came) == 1
    assert learner.rejections.by_reason() == {"checksum": 1}


def test_the_server_lives_on_when_an_answer_fails(learner: Server, client: Session) -> None:
    def fail() -> None:
        raise RuntimeError

    learner.snapshots.status = fail  # type: ignore[assignment]
    (answer,) = ask(client, KEYS.status, timeout_s=5.0)
    assert decode(answer.payload, Refused).reason == "internal"
    learner.snapshots.status = samples.status_reply
    (answer,) = ask(client, KEYS.status, timeout_s=5.0)
    assert answer.key == KEYS.status


# --- faults ---

_LEARNER = """
import sys
from tests import wire_samples as samples
from hoz_dist.wire.messages import Accepted
with samples.serving(sys.argv[1], epoch=int(sys.argv[2])) as (server, session):
    print("ready", flush=True)
    while True:
        request = server.inbox.take(60)
        print(request.message.sequence, flush=True)
        if request.message.sequence != 1 or int(sys.argv[2]) > 1:
            request.answer(Accepted(int(sys.argv[2]), 1))
"""


@contextmanager
def learner_process(endpoint: str, epoch: int) -> Iterator["subprocess.Popen[str]"]:
    """A learner in a process of its own; in its first epoch it takes push 1 and never answers it."""
    command = [sys.executable, "-c", _LEARNER, endpoint, str(epoch)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


def test_a_push_outlives_a_killed_learner(endpoint: str) -> None:
    replies: list[PushReply] = []
    with learner_process(endpoint, epoch=1) as first, open_client(endpoint) as session:
        assert first.stdout is not None
        pusher = Pusher(session, threading.Event())
        assert decode(_first(_raw_push(session, GRADS, _encoded(0))), Accepted).epoch == 1
        assert first.stdout.readline() == "0\n"
        thread = threading.Thread(target=lambda: replies.append(pusher.push(GRADS, samples.gradient_push(1))))
        thread.start()
        assert first.stdout.readline() == "1\n"
        os.kill(first.pid, signal.SIGKILL)
        first.wait(WAIT_S)
        with learner_process(endpoint, epoch=2) as second:
            began = time.monotonic()
            thread.join(WAIT_S)
            assert time.monotonic() - began < 5.0
            assert second.stdout is not None
            assert second.stdout.readline() == "1\n"
    assert isinstance(replies[0], Accepted)
    assert replies[0].epoch == 2


def _first(answers: list[bytes]) -> bytes:
    return answers[0]


def test_members_are_the_holders_of_live_tokens(endpoint: str) -> None:
    with samples.serving(endpoint) as (_, session), Members(session, KEYS) as members:
        with open_client(endpoint) as first, open_client(endpoint) as second:
            tokens = [
                declare_alive(first, KEYS, Member("actor", "a1")),
                declare_alive(second, KEYS, Member("actor", "a0")),
            ]
            assert until(lambda: members.current() == (("actor", "a0"), ("actor", "a1")))
            with Members(first, KEYS) as late:
                assert until(lambda: late.current() == members.current()), "a late watcher knows who came before"
            tokens[1].undeclare()  # type: ignore[no-untyped-call]
            assert until(lambda: members.current() == (("actor", "a1"),))
        assert until(lambda: members.current() == ())


def test_tokens_with_strange_names_are_ignored(endpoint: str) -> None:
    with (
        samples.serving(endpoint) as (_, session),
        Members(session, KEYS) as members,
        open_client(endpoint) as stranger,
    ):
        strange = stranger.liveliness().declare_token(f"hoz/{KEYS.run}/alive/actor/a b;c")
        with strange, declare_alive(stranger, KEYS, Member("actor", "a0")):
            assert until(lambda: members.current() == (("actor", "a0"),))


def test_a_learner_that_is_away_is_said_once_and_so_is_its_return(
    endpoint: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "hoz_dist.wire")
    with open_router(endpoint) as session, open_client(endpoint) as client:
        pusher = Pusher(client, threading.Event())
        follower = ParametersFollower(client, KEYS, threading.Event())
        with pytest.raises(ConnectionFailedError):
            pusher.push(GRADS, samples.gradient_push(), deadline_s=0.5)
        with pytest.raises(ConnectionFailedError):
            follower.fetch(timeout_s=0.5)
        away = "the learner does not answer; trying again"
        assert [record.getMessage() for record in caplog.records] == [away, away]
        caplog.clear()
        snapshots = Snapshots(samples.config_reply(), samples.status_reply, "product")
        with Server(session, KEYS, snapshots) as server, ParametersPublisher(session, KEYS) as publisher, follower:
            publisher.publish(1, 0, np.zeros(3, np.float32))
            with answering(server.inbox, lambda _: Accepted(1, 1)):
                for sequence in range(2):
                    pusher.push(GRADS, samples.gradient_push(sequence), deadline_s=WAIT_S)
                    follower.fetch(timeout_s=WAIT_S)
        assert [record.getMessage() for record in caplog.records if "learner" in record.getMessage()] == [
            "the learner answers again"
        ] * 2


# --- parameters and graphs ---


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
            assert until(lambda: late.newest is not None and late.newest.digest == head.digest), "late joiners know"
        (answer,) = ask(client, KEYS.params, timeout_s=5.0)
        assert decode(answer.payload, ParametersHead).digest == head.digest


def test_parameters_of_several_shards_are_never_mixed(learner: Server, client: Session) -> None:
    stop = threading.Event()
    size = 2 * SHARD_ELEMENTS + 5
    with (
        ParametersFollower(client, KEYS, threading.Event()) as follower,
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
            assert fetched.head.shards == 3
            assert (fetched.vector == fetched.head.version).all()
        stop.set()
        thread.join(WAIT_S)
    assert stamps == sorted(stamps)


def test_parameters_never_run_backwards_but_a_new_epoch_may_begin_lower(learner: Server, client: Session) -> None:
    with (
        ParametersFollower(client, KEYS, threading.Event()) as follower,
        ParametersPublisher(learner.session, KEYS) as publisher,
    ):
        publisher.publish(2, 9, np.ones(3, np.float32))
        assert follower.fetch(timeout_s=WAIT_S).head.stamp == (2, 9)
        for older in ((2, 8), (1, 50)):
            publisher.publish(*older, np.zeros(3, np.float32))
            with pytest.raises(ConnectionFailedError, match="did not serve parameters"):
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


def test_graphs_are_published_when_they_change(learner: Server, client: Session) -> None:
    with NewestSubscriber(client, KEYS.graph("*"), SceneGraphReply) as graphs:
        learner.put_graph(samples.scene_graph(version=1))
        learner.put_graph(samples.room_graph())
        key = KEYS.graph("kitchen")
        assert graphs.wait_for(lambda newest: key in newest, WAIT_S)
        learner.put_graph(samples.scene_graph(version=2))
        assert graphs.wait_for(lambda newest: newest[key].version == 2, WAIT_S)
        assert set(graphs.newest) == {key}, "room graphs have keys of their own"
        with NewestSubscriber(client, KEYS.graph("*"), SceneGraphReply) as late:
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
