"""An actor's link to its learner: what it bears with, and what ends it."""

import dataclasses
import json
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.config import RunConfig
from hoz_dist.errors import HozError
from hoz_dist.nav.categories import TARGETS
from hoz_dist.waiting import StoppedError
from hoz_dist.wire.client import epochs
from hoz_dist.wire.client.epochs import AnotherRunError
from hoz_dist.wire.protocol.answers import Accepted, PushReply, Refused
from hoz_dist.wire.protocol.message import MAX_EPISODES
from hoz_dist.wire.protocol.pushes import EpisodesPush, Push
from hoz_dist.wire.protocol.run_messages import ConfigReply
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.session import Session, open_client, open_router
from tests import wire_samples as samples
from tests.integration.wire.pushing import KEYS, WAIT_S, answering, until
from workers import link as link_module
from workers.journal import Journal
from workers.link import LearnerLink

pytestmark = pytest.mark.integration
GRADIENT = np.ones(3, np.float32)


@contextmanager
def learner(
    session: Session, epoch: int = 1, version: int = 5, config: RunConfig | None = None
) -> Iterator[tuple[Server, ParametersPublisher]]:
    reply = ConfigReply(KEYS.run, epoch, TARGETS, (config or RunConfig()).to_json())
    snapshots = Snapshots(reply, samples.status_reply, "product")
    with Server(session, KEYS, snapshots) as server, ParametersPublisher(session, KEYS) as publisher:
        publisher.publish(epoch, version, np.zeros(3, np.float32))
        yield server, publisher


@pytest.fixture
def sessions(endpoint: str) -> Iterator[tuple[Session, Session]]:
    """A learner's and an actor's."""
    with open_router(endpoint) as first, open_client(endpoint) as second:
        yield first, second


def joined(session: Session, stop: threading.Event | None = None, journal: Journal | None = None) -> LearnerLink:
    return LearnerLink(session, "a0", None, stop or threading.Event(), journal)


def test_each_acknowledged_push_is_in_the_journal_and_refused_ones_are_not(
    sessions: tuple[Session, Session], tmp_path: Path
) -> None:
    def decide(push: Push) -> PushReply:
        return Refused("stale", "too old", 1) if push.sequence == 1 else Accepted(1, 6 + push.sequence)

    path = tmp_path / "a0.jsonl"
    with (
        learner(sessions[0]) as (server, _),
        answering(server.inbox, decide),
        Journal(path) as journal,
        joined(sessions[1], journal=journal) as link,
    ):
        for _ in range(3):
            link.push_gradient(GRADIENT, 40, (1, 5))
        link.push_episodes([samples.EPISODE], {})
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [(line["kind"], line["sequence"], line["version"]) for line in lines] == [
        ("gradient", 0, 6),
        ("gradient", 2, 8),
        ("episodes", 0, 6),
    ]


def test_episodes_that_do_not_fit_into_a_message_go_in_several(sessions: tuple[Session, Session]) -> None:
    pushed = []

    def decide(push: Push) -> PushReply:
        assert isinstance(push, EpisodesPush)
        pushed.append((push.sequence, len(push.episodes), push.entropy))
        return Refused("internal", "the disk is full", 1) if push.sequence == 3 else Accepted(1, 6)

    episodes = [samples.EPISODE] * (MAX_EPISODES + 1)
    with learner(sessions[0]) as (server, _), answering(server.inbox, decide), joined(sessions[1]) as link:
        assert isinstance(link.push_episodes([], {}), Accepted)
        assert isinstance(link.push_episodes(episodes, {"entropy": 1.5}), Accepted)
        assert isinstance(link.push_episodes(episodes, {}), Refused)
    assert pushed == [(0, 0, 0.0), (1, MAX_EPISODES, 1.5), (2, 1, 1.5), (3, MAX_EPISODES, 0.0)]


def test_a_learner_that_fails_once_or_forgets_is_told_a_room_graph_again(
    sessions: tuple[Session, Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(link_module, "GRAPH_S", 0.3)
    with learner(sessions[0]) as (server, _), joined(sessions[1]) as link:

        def decide(push: Push) -> PushReply:
            if push.sequence == 0:
                return Refused("internal", "see the log", 1)
            if push.sequence == 2:
                server.put_graph(samples.scene_graph())
            return Accepted(1, 5)

        with answering(server.inbox, decide) as came:
            assert isinstance(link.push_room_graph(samples.room_graph()), Accepted)
        assert [push.sequence for push in came] == [0, 1, 2]
        assert samples.ROOM in link.scene_graphs()["kitchen"].rooms


def test_an_actor_that_waits_for_a_graph_can_be_stopped(sessions: tuple[Session, Session]) -> None:
    stop = threading.Event()
    caught: list[BaseException] = []
    with learner(sessions[0]) as (server, _), joined(sessions[1], stop) as link:

        def push() -> None:
            try:
                link.push_room_graph(samples.room_graph())
            except StoppedError as error:
                caught.append(error)

        with answering(server.inbox, lambda _: Accepted(1, 5)) as came:
            thread = threading.Thread(target=push)
            thread.start()
            assert until(lambda: len(came) == 1)
            began = time.monotonic()
            stop.set()
            thread.join(WAIT_S)
    assert caught
    assert time.monotonic() - began < 2.0


def test_a_graph_of_a_learner_that_was_replaced_does_not_come_back(
    sessions: tuple[Session, Session], endpoint: str
) -> None:
    with ExitStack() as stack:
        new, _ = stack.enter_context(learner(sessions[0], epoch=2))
        new.put_graph(samples.scene_graph(version=3))
        link = stack.enter_context(joined(sessions[1]))
        assert until(lambda: "kitchen" in link.scene_graphs())
        old, parameters = stack.enter_context(learner(stack.enter_context(open_client(endpoint)), epoch=1))
        old.put_graph(samples.scene_graph(version=9))
        parameters.publish(1, 99, np.ones(3, np.float32))
        new.put_graph(samples.scene_graph(version=4))
        assert until(lambda: link.scene_graphs()["kitchen"].version == 4)
        assert link.parameters().head.stamp == (2, 5)


def test_another_configuration_or_other_categories_end_an_actor(sessions: tuple[Session, Session]) -> None:
    with learner(sessions[0]), joined(sessions[1]) as link:
        link.check_same_run()
        with learner(sessions[0], epoch=2, config=RunConfig(seed=4)), pytest.raises(HozError, match=r"seed: 4, 0"):
            link.check_same_run()
    with learner(sessions[0]) as (server, _):
        server.snapshots.config = dataclasses.replace(server.snapshots.config, categories=TARGETS[::-1])
        with pytest.raises(HozError, match="has other categories: run the same release"):
            joined(sessions[1])


def test_a_run_that_is_begun_anew_ends_an_actor(
    sessions: tuple[Session, Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(epochs, "ANOTHER_RUN_S", 0.3)
    with ExitStack() as stack:
        with learner(sessions[0], epoch=3):
            link = stack.enter_context(joined(sessions[1]))
            assert link.parameters().head.stamp == (3, 5)
        with learner(sessions[0], epoch=1) as (server, _), answering(server.inbox, lambda _: Accepted(1, 6)):
            with pytest.raises(AnotherRunError, match="in epoch 1 and was in 3"):
                link.push_gradient(GRADIENT, 40, (3, 5))
            with pytest.raises(AnotherRunError, match="in epoch 1 and was in 3"):
                link.parameters()
