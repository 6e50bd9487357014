"""Pushes that are damaged or not what they should be."""

import threading

import pytest
import zenoh

from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.codec import decode, encode
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.ask import ask
from hoz_dist.wire.transport.session import Session, open_client, open_router
from tests import wire_samples as samples
from tests.integration.wire.pushing import GRADS, KEYS, WAIT_S, answering, encoded_gradient, push_to, raw_push

pytestmark = pytest.mark.integration


@pytest.mark.parametrize(
    ("key", "payload", "attachment", "reason"),
    [
        (GRADS, b"", None, "malformed"),
        (GRADS, b"\x00\xff", None, "malformed"),
        (GRADS, encoded_gradient(0), b"12345678", "checksum"),
        (GRADS, encoded_gradient(0), b"", "checksum"),
        (GRADS, encode(samples.MESSAGES[1]), None, "kind"),
        (KEYS.grads("a1"), encoded_gradient(0), None, "identity"),
        (KEYS.rollouts("a1"), encode(samples.MESSAGES[1]), None, "identity"),
        (KEYS.rollouts("a1"), encode(samples.trajectory_push()), None, "identity"),
        (GRADS, encode(samples.trajectory_push()), None, "kind"),
        (KEYS.room("a0", RoomId("kitchen", 4)), encode(samples.MESSAGES[2]), None, "identity"),
        (KEYS.all_grads, encoded_gradient(0), None, "identity"),
    ],
)
def test_a_bad_push_gets_one_answer_with_its_reason_and_is_counted(
    learner: Server, client: Session, key: str, payload: bytes, attachment: bytes | None, reason: str
) -> None:
    (answer,) = raw_push(client, key, payload, attachment)
    assert decode(answer, Refused).reason == reason
    assert learner.rejections.by_reason() == {reason: 1}
    assert learner.inbox.take(0) is None


def test_a_bad_push_of_a_room_is_counted_for_its_actor(learner: Server, client: Session) -> None:
    key = KEYS.room("a0", samples.ROOM)
    raw_push(client, key, b"")
    assert learner.rejections.by_sender() == {"a0": 1}


def test_a_gradient_longer_than_the_policy_is_refused_by_its_size(endpoint: str) -> None:
    snapshots = Snapshots(samples.config_reply(), samples.status_reply, "product")
    with (
        open_router(endpoint) as session,
        Server(session, KEYS, snapshots, parameters=100) as server,
        open_client(endpoint) as client,
    ):
        (answer,) = raw_push(client, GRADS, encoded_gradient(0, size=2000))
        refused = decode(answer, Refused)
        assert (refused.reason, refused.detail) == ("size", "the message has 8128 bytes, more than 4496")
        with answering(server.inbox, lambda _: Accepted(1, 1)) as came:
            push_to(client, samples.gradient_push(size=100))
        assert len(came) == 1


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
    assert learner.rejections.by_reason() == {"internal": 1}
    learner.snapshots.status = samples.status_reply
    (answer,) = ask(client, KEYS.status, timeout_s=5.0)
    assert answer.key == KEYS.status
