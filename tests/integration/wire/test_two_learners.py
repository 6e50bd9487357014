"""Two learners of one run: the one of the lower epoch was asleep, and does not know yet that it was replaced."""

import dataclasses
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import numpy as np
import pytest

from hoz_dist.client import HozClient
from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.client.discovery import find_run, find_runs
from hoz_dist.wire.client.epochs import Epochs
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.protocol.answers import Accepted, PushReply, Refused
from hoz_dist.wire.protocol.pushes import GradientPush, Push
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.ask import STRAGGLERS_S
from hoz_dist.wire.transport.session import Session, open_client, open_router
from tests import wire_samples as samples
from tests.integration.wire.pushing import GRADS, KEYS, WAIT_S, answering, push_to

pytestmark = pytest.mark.integration


class Learner:
    """A learner of an epoch behind a router: it accepts gradients of its own epoch and refuses the others."""

    def __init__(self, endpoint: str, epoch: int) -> None:
        self.epoch = epoch
        self._open = ExitStack()
        session = self._open.enter_context(open_client(endpoint))
        status = dataclasses.replace(samples.status_reply(), epoch=epoch)
        snapshots = Snapshots(samples.config_reply(epoch), lambda: status, "product")
        self.parameters = self._open.enter_context(ParametersPublisher(session, KEYS))
        self.parameters.publish(epoch, 10 - epoch, np.full(3, epoch, np.float32))
        self.server = self._open.enter_context(Server(session, KEYS, snapshots))
        self.server.put_graph(samples.scene_graph(version=10 - epoch))

    def decide(self, push: Push) -> PushReply:
        assert isinstance(push, GradientPush)
        if push.epoch == self.epoch:
            return Accepted(self.epoch, 10 - self.epoch)
        return Refused("epoch", f"computed in epoch {push.epoch}, now is {self.epoch}", self.epoch)

    def start(self) -> list[Push]:
        """Take pushes from now on."""
        return self._open.enter_context(answering(self.server.inbox, self.decide))

    def close(self) -> None:
        self._open.close()


@contextmanager
def learners(endpoint: str, *epochs: int) -> Iterator[tuple[Session, list[Learner]]]:
    """A client's session and learners of these epochs."""
    with ExitStack() as stack:
        stack.enter_context(open_router(endpoint))
        made = [Learner(endpoint, epoch) for epoch in epochs]
        for learner in made:
            stack.callback(learner.close)
        yield stack.enter_context(open_client(endpoint)), made


@pytest.mark.parametrize("epochs", [(1, 2), (2, 1)])
def test_who_asks_gets_the_answer_of_the_highest_epoch(endpoint: str, epochs: tuple[int, int]) -> None:
    with learners(endpoint, *epochs) as (session, _), HozClient(endpoint) as client:
        assert find_run(session, None).epoch == 2
        assert [config.epoch for config in find_runs(session)] == [2]
        assert client.config()["epoch"] == 2
        assert client.status()["epoch"] == 2
        assert client.graph("kitchen").version == 8
        with ParametersFollower(session, KEYS, threading.Event()) as follower:
            assert follower.fetch(timeout_s=WAIT_S).head.stamp == (2, 8)


def test_a_gradient_of_the_old_epoch_is_refused_by_the_new_learner_even_if_the_old_one_takes_it(endpoint: str) -> None:
    with learners(endpoint, 1, 2) as (session, made):
        came = [learner.start() for learner in made]
        old = samples.gradient_push(0)
        assert old.epoch == 1
        reply = push_to(session, old)
        assert isinstance(reply, Refused)
        assert (reply.reason, reply.epoch) == ("epoch", 2)
        new = dataclasses.replace(old, sequence=1, epoch=2)
        reply = push_to(session, new)
        assert isinstance(reply, Accepted)
        assert reply.epoch == 2
        assert [[push.sequence for push in pushes] for pushes in came] == [[0, 1], [0, 1]]


def test_an_actor_of_the_new_epoch_takes_nothing_from_the_old_learner(endpoint: str) -> None:
    epochs = Epochs()
    with learners(endpoint, 1) as (session, (old,)):
        old.start()
        pusher = Pusher(session, threading.Event(), epochs=epochs)
        follower = ParametersFollower(session, KEYS, threading.Event(), epochs)
        with follower:
            assert follower.fetch(timeout_s=WAIT_S).head.stamp == (1, 9)
            push = samples.gradient_push(0)
            assert isinstance(pusher.push(GRADS, push, WAIT_S), Accepted)
            epochs.hear(2)  # from a learner that went away again
            with pytest.raises(ConnectionFailedError):
                pusher.push(GRADS, dataclasses.replace(push, sequence=1), 0.3)
            with pytest.raises(ConnectionFailedError):
                follower.fetch(timeout_s=0.3)
            new = Learner(endpoint, 2)
            new.start()
            assert follower.fetch(timeout_s=WAIT_S).head.stamp == (2, 8)
            accepted = pusher.push(GRADS, dataclasses.replace(push, sequence=2, epoch=2), WAIT_S)
            assert isinstance(accepted, Accepted)
            assert accepted.epoch == 2
            new.close()


def test_an_old_learner_that_stands_still_delays_the_answer_of_the_new_one_but_briefly(endpoint: str) -> None:
    with learners(endpoint, 1, 2) as (session, (_, new)):
        new.start()  # nobody takes anything out of the old one's inbox
        began = time.monotonic()
        reply = push_to(session, dataclasses.replace(samples.gradient_push(0), epoch=2))
        assert isinstance(reply, Accepted)
        assert time.monotonic() - began < STRAGGLERS_S + 1.0
