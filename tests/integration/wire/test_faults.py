"""Learners that are killed, away or started again; who is alive."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.membership.liveliness import Member, Members, declare_alive
from hoz_dist.wire.protocol.answers import Accepted, PushReply
from hoz_dist.wire.protocol.codec import decode
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.session import open_client, open_router
from tests import wire_samples as samples
from tests.integration.wire.pushing import GRADS, KEYS, WAIT_S, answering, encoded_gradient, raw_push, until

pytestmark = pytest.mark.integration


_LEARNER = """
import sys
from tests import wire_samples as samples
from hoz_dist.wire.protocol.answers import Accepted
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
        assert decode(_first(raw_push(session, GRADS, encoded_gradient(0))), Accepted).epoch == 1
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
                declare_alive(first, KEYS, Member("actor", "a1", "h", 1)),
                declare_alive(second, KEYS, Member("actor", "a0", "h", 2)),
            ]
            assert until(lambda: members.current() == (("actor", "a0", "h", 2), ("actor", "a1", "h", 1)))
            with Members(first, KEYS) as late:
                assert until(lambda: late.current() == members.current()), "a late watcher knows who came before"
            tokens[1].undeclare()  # type: ignore[no-untyped-call]
            assert until(lambda: members.current() == (("actor", "a1", "h", 1),))
        assert until(lambda: members.current() == ())


def test_tokens_with_strange_names_are_ignored(endpoint: str) -> None:
    with (
        samples.serving(endpoint) as (_, session),
        Members(session, KEYS) as members,
        open_client(endpoint) as stranger,
    ):
        strange = stranger.liveliness().declare_token(f"hoz/{KEYS.run}/alive/actor/a b;c/h/3")
        with strange, declare_alive(stranger, KEYS, Member("actor", "a0", "h", 2)):
            assert until(lambda: members.current() == (("actor", "a0", "h", 2),))


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
