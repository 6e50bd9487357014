"""With the right keys everything works."""

import threading

import numpy as np
import pytest

from hoz_dist.client import HozClient
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.membership.liveliness import Member, Members, declare_alive
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.codec import decode
from hoz_dist.wire.protocol.graph_messages import SceneGraphReply
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, Push, RoomGraphPush
from hoz_dist.wire.transport.publishing import NewestSubscriber
from tests import wire_samples as samples
from tests.integration.security.network import KEYS, Network
from tests.integration.wire.pushing import until

pytestmark = pytest.mark.integration


def test_a_viewer_asks_for_graphs_plans_and_the_status(network: Network) -> None:
    with HozClient(network.endpoint, credentials=network.credentials("viewer-v0")) as client:
        assert client.runs() == [KEYS.run]
        assert client.config()["run"] == KEYS.run
        assert client.graph("kitchen").scene == "kitchen"
        assert client.plan("kitchen", "Sink", ["Fridge"]).path
        assert client.status()["epoch"] == 1


@pytest.mark.parametrize(
    ("key", "kind"),
    [
        (KEYS.grads("a0"), GradientPush),
        (KEYS.rollouts("a0"), EpisodesPush),
        (KEYS.room("a0", samples.ROOM), RoomGraphPush),
    ],
)
def test_an_actor_pushes_under_its_own_name(network: Network, key: str, kind: type[Push]) -> None:
    push = next(message for message in samples.MESSAGES if isinstance(message, kind))
    with network.open("actor-a0") as actor:
        [answer] = network.push(actor, key, push)
    assert isinstance(decode(answer.payload, Accepted), Accepted)


def test_an_actor_hears_of_parameters_before_and_after_it_came(network: Network) -> None:
    stop = threading.Event()
    with (
        network.open("actor-a0") as first,
        network.open("actor-a1") as second,
        ParametersFollower(first, KEYS, stop) as early,
    ):
        network.parameters.publish(1, 1, np.zeros(3, np.float32))
        assert until(lambda: early.newest is not None)
        with ParametersFollower(second, KEYS, stop) as late:
            assert until(lambda: late.newest is not None)
            network.parameters.publish(1, 2, np.ones(3, np.float32))
            assert until(lambda: [one.newest and one.newest.version for one in (early, late)] == [2, 2])
            for follower in (early, late):
                assert follower.fetch((1, 2), timeout_s=5.0).vector.sum() == 3


def test_an_actor_hears_of_graphs(network: Network) -> None:
    with (
        network.open("actor-a0") as actor,
        NewestSubscriber(
            actor,
            KEYS.graph("*"),
            SceneGraphReply,
            key_of=lambda graph: KEYS.graph(graph.scene),
            replaces=lambda _, __: True,
        ) as graphs,
    ):
        assert until(lambda: KEYS.graph("kitchen") in graphs.newest)


def test_a_learner_knows_who_is_alive(network: Network) -> None:
    actor, standby = Member("actor", "a0", "h", 1), Member("standby", "l1", "h", 2)
    with (
        Members(network.learner, KEYS) as members,
        network.open("actor-a0") as first,
        network.open("learner-l1") as second,
        Members(second, KEYS) as seen_by_standby,
    ):
        token = declare_alive(first, KEYS, actor)
        with declare_alive(second, KEYS, standby):
            assert until(lambda: members.current() == seen_by_standby.current() == (actor, standby))
            token.undeclare()  # type: ignore[no-untyped-call]
            assert until(lambda: members.current() == (standby,))
