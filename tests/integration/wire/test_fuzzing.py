"""Hostile messages against a real learner: each is answered and counted, and none changes anything."""

import random
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.client import HozClient
from hoz_dist.gradient_forms import Bf16Gradient, Gradient
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.codec import decode, encode
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.parameters import Parameters
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.transport.ask import ask
from hoz_dist.wire.transport.session import Session, open_client
from tests import wire_samples as samples
from tests.integration.learning import CONFIG, FakeActor, gradient_for, graph_of, running_learner, status_when
from tests.integration.wire.pushing import raw_push
from tests.mutations import MUTATIONS, any_value

pytestmark = pytest.mark.integration
SEED = 20210816
MALLORY = "mallory"
ROOM = RoomId("kitchen", 3)


def gradients(parameters: Parameters) -> list[bytes]:
    """Well-formed gradients that this learner must not apply, each for two reasons: a mutation may mend one.

    Only the last is wrong by its norm alone, which the learner looks at when all else is right; no mutation mends that.
    """
    epoch, version = parameters.head.stamp
    good, frames = gradient_for(parameters, 0), CONFIG.batch * CONFIG.rollout_steps + 1
    wrong: tuple[tuple[int, int, int, Gradient], ...] = (
        (epoch + 1, version + 1, 20, good),
        (epoch, version + 1, frames, good),
        (epoch, version, 20, 1.1 * good[1000:]),
        (epoch, version, frames, 1.1 * good),
        (epoch, version, frames, np.full(100, 3e38, np.float32)),
        (epoch, version, frames, Bf16Gradient(np.zeros(good.size, np.uint16))),
        (epoch, version, 20, 1.1 * good),
    )
    return [encode(GradientPush(MALLORY, 66, sequence, *fields)) for sequence, fields in enumerate(wrong)]


def graphs() -> list[bytes]:
    """Well-formed room graphs that this learner must not merge, each for two reasons."""
    good, other = graph_of(str(ROOM)), samples.room_graph()  # of other zones
    assert len(other.nodes) != len(good.nodes)
    wrong = (
        ("0" * 16, TARGETS, other),
        (good.digest, TARGETS[::-1], other),
        ("0" * 16, TARGETS[::-1], good),
    )
    return [
        encode(RoomGraphPush(MALLORY, 66, sequence, ROOM, digest, categories, graph.nodes, graph.edges))
        for sequence, (digest, categories, graph) in enumerate(wrong)
    ]


def is_valid(data: bytes) -> bool:
    try:
        decode(data, EpisodesPush)
    except RejectedError:
        return False
    return True


def attack(session: Session, keys: Keys, parameters: Parameters, count: int) -> Counter[str]:
    """Push hostile messages, and return how often each reason was given."""
    rng = random.Random(SEED)
    reports = [encode(EpisodesPush(MALLORY, 66, 0, episodes=(samples.EPISODE,)))]
    kinds = (
        (keys.grads(MALLORY), gradients(parameters)),
        (keys.rollouts(MALLORY), reports),
        (keys.room(MALLORY, ROOM), graphs()),
    )
    everything = [data for _, messages in kinds for data in messages]
    reasons: Counter[str] = Counter()
    while reasons.total() < count:
        key, messages = rng.choice(kinds)
        data = rng.choice(messages)
        attachment = None
        match rng.randrange(10):
            case 0 if messages is not reports:
                pass  # as it is
            case 1:
                attachment = rng.randbytes(rng.choice((0, 7, 8, 9, 1000)))
            case 2:
                key = rng.choice((keys.grads("alice"), keys.rollouts("alice"), keys.room("alice", ROOM)))
            case _:
                data = rng.choice(MUTATIONS)(data, rng.choice(everything), rng)
        if is_valid(data) and attachment is None and key == keys.rollouts(MALLORY):
            continue  # a report of episodes that happens to be right
        (answer,) = raw_push(session, key, data, attachment)
        reasons[decode(answer, Refused).reason] += 1
    return reasons


def besiege(port: int, run: Path, count: int) -> Counter[str]:
    keys = Keys(run.name)
    with (
        running_learner(port, run) as endpoint,
        HozClient(endpoint) as client,
        FakeActor(endpoint, run.name, "alice") as alice,
        open_client(endpoint) as session,
    ):
        assert isinstance(alice.room_graph(0, graph_of("kitchen/1")), Accepted)
        before = alice.fetch()
        graph = client.graph("kitchen")
        reasons = attack(session, keys, before, count)
        status = status_when(client, lambda status: sum(status["rejected"].values()) >= count)
        assert status["rejected"] == dict(reasons), "each is counted, once and under its reason"
        assert (status["version"], status["frames"], status["episodes"], status["duplicates"]) == (0, 0, 0, 0)
        after = client.graph("kitchen")
        assert (after.version, after.rooms) == (graph.version, graph.rooms)
        np.testing.assert_array_equal(after.nodes, graph.nodes)
        np.testing.assert_array_equal(alice.fetch().vector, before.vector)
        accepted = alice.gradient(0, before.head.stamp, gradient_for(before, 0))
        assert isinstance(accepted, Accepted)
        assert accepted.version == 1
    return reasons


def test_hostile_pushes_are_answered_counted_and_change_nothing(free_port: int, tmp_path: Path) -> None:
    besiege(free_port, tmp_path / "run", 200)


@pytest.mark.long
@pytest.mark.timeout(900)
def test_thousands_of_hostile_pushes_are_answered_counted_and_change_nothing(free_port: int, tmp_path: Path) -> None:
    reasons = besiege(free_port, tmp_path / "run", 5000)
    never_here = {Reason.SPLIT, Reason.FINISHED, Reason.NOT_FOUND, Reason.GONE, Reason.INTERNAL}
    assert set(Reason) - never_here <= reasons.keys(), "each reason that a push can have occurs"


def test_hostile_questions_are_answered_and_counted(free_port: int, tmp_path: Path) -> None:
    rng = random.Random(SEED)
    with running_learner(free_port, tmp_path / "run") as endpoint, HozClient(endpoint) as client:
        keys = Keys("run")
        with open_client(endpoint) as session:
            questions = [
                keys.plan("garage"),
                keys.plan("x" * 5000) + "?target=Pan",
                f"{keys.plan('kitchen')}?seen=Sink",
                f"{keys.plan('kitchen')}?{'target=Pan;' * 1000}",
                keys.graph("kitchen/31"),
                keys.graph("kitchen/" + "9" * 4500),
                keys.graph("a/b/c"),
                keys.shard(0),
                f"{keys.shard(0)}?reader={'r' * 65}",
                f"{keys.shard(9)}?reader=r",
                f"{keys.params}/-1?reader=r",
                f"{keys.params}/*?reader=r",
                f"{keys.params}/0/1?reader=r",
                f"{keys.shard(0)}?reader=r;version=1",
                f"{keys.shard(0)}?reader=r;epoch=1;version={'9' * 30}",
                f"{keys.shard(0)}?reader=r;epoch=nan;version=1",
            ]
            for _ in range(40):
                strange = "".join(character for character in str(any_value(rng)) if character not in "?#$*/")
                questions.append(f"{keys.shard(0)}?reader=r;epoch={strange[:50]} ;version=1")
            for question in questions:
                (answer,) = ask(session, question, timeout_s=5.0)
                assert decode(answer.payload, Refused).epoch == 1
        assert sum(client.status()["rejected"].values()) == len(questions)
