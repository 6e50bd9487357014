"""The core in a run that learns from rollouts."""

import dataclasses
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hoz_dist.config import RunConfig
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.wire.protocol.answers import Accepted, Busy, Refused
from hoz_dist.wire.protocol.pushes import GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.trajectories import Flag, GraphUsed, RoomUsed, TrajectoryPush
from learner.admission import Admission
from learner.core import LearnerCore
from learner.events import (
    EpisodesReceived,
    GradientReceived,
    OpenRoom,
    PublishParameters,
    RecordUpdate,
    Reply,
    RoomGraphReceived,
    RoomOpened,
    RoomUnusable,
    TrajectoryReceived,
)
from learner.replay import Schedule, UpdateRecord
from learner.rollout_gradients import Learnt
from tests.unit.learner.making import answer, episodes, gradient, replies
from tests.unit.workers.making import CONFIG, KITCHEN, make_collector, room_views, scene_graph
from workers.collector import Collector

ROLLOUTS = replace(CONFIG, learn_from="rollouts", max_lag=2)
VIEWS = room_views(KITCHEN)
USED = (GraphUsed("kitchen", 1, 1),)


def kitchen_graph() -> RoomGraphPush:
    """What makes the scene graph that `make_collector` uses."""
    graph = scene_graph("kitchen", 0)
    room = RoomGraph(str(KITCHEN), "d1", graph.nodes, graph.edges)
    return RoomGraphPush("a", 1, 0, KITCHEN, room.digest, TARGETS, room.nodes, room.edges)


def new_core(config: RunConfig = ROLLOUTS, *, opened: bool = True, **options: object) -> LearnerCore:
    core = LearnerCore(config, initial_parameters(config.policy, config.seed), **options)  # type: ignore[arg-type]
    core.handle(RoomGraphReceived(0, kitchen_graph()), 0.0)
    if opened:
        core.handle(RoomOpened(VIEWS), 0.0)
    return core


def rollout(actor: Collector, sequence: int = 0, version: int = 0, epoch: int = 1) -> TrajectoryPush:
    trajectory = actor.record()
    return TrajectoryPush("a", 1, sequence, epoch, version, trajectory.rooms, USED, trajectory.steps)


def refused(core: LearnerCore, push: TrajectoryPush | GradientPush) -> Refused:
    event = TrajectoryReceived(0, push) if isinstance(push, TrajectoryPush) else GradientReceived(0, push)
    reply = answer(core, event)
    assert isinstance(reply, Refused)
    return reply


def test_a_rollout_is_learnt_from_published_recorded_and_acknowledged() -> None:
    core, actor = new_core(), make_collector(ROLLOUTS)
    before = core.parameters.copy()
    push = rollout(actor)
    effects = core.handle(TrajectoryReceived(7, push), now=0.0)
    assert [type(effect) for effect in effects] == [RecordUpdate, PublishParameters, Reply]
    assert effects[0] == RecordUpdate(UpdateRecord("a", 1, 0, 0, 0, ROLLOUTS.learning_rate))
    (reply,) = replies(effects)
    assert reply.request == 7
    assert isinstance(reply.answer, Accepted)
    assert reply.answer.version == 1
    assert (core.parameters != before).any()
    assert core.statistics.frames == push.frames
    assert core.statistics.losses["entropy"] == pytest.approx(np.log(6), abs=0.1)


def test_without_lag_a_run_goes_as_one_that_learns_from_gradients() -> None:
    by_rollouts, by_gradients = new_core(), new_core(replace(ROLLOUTS, learn_from="gradients"))
    actor, other = make_collector(ROLLOUTS), make_collector(ROLLOUTS)
    for version in range(3):
        actor.load(by_rollouts.parameters, by_rollouts.version)
        other.load(by_rollouts.parameters, by_rollouts.version)
        answer(by_rollouts, TrajectoryReceived(0, rollout(actor, version, version)))
        update = other.roll_out()
        push = GradientPush("a", 1, version, 1, version, update.frames, update.gradient)
        assert isinstance(answer(by_gradients, GradientReceived(0, push)), Accepted)
        found, expected = (core.snapshot(0.0).adam.first_moment for core in (by_rollouts, by_gradients))
        np.testing.assert_allclose(found, expected, rtol=1e-3, atol=2e-5 * float(np.abs(expected).max()))
    assert by_rollouts.statistics.frames == by_gradients.statistics.frames
    assert by_rollouts.version == 3


def test_a_rollout_of_which_nothing_is_known_moves_nothing() -> None:
    """Adam would make a full step of its tiny gradient."""
    config = replace(ROLLOUTS, batch=2, rollout_steps=2)
    core, actor = new_core(config), make_collector(config, max_actions=100)
    push = rollout(actor)
    while push.steps.has(Flag.FIRST).any():
        push = rollout(actor, 1)
    before = core.parameters.copy()
    assert isinstance(answer(core, TrajectoryReceived(0, push)), Accepted)
    assert core.version == 1
    np.testing.assert_array_equal(core.parameters, before)
    assert core.statistics.frames == 0
    assert core.statistics.losses == {}, "nothing is known of the loss either"


@pytest.mark.parametrize("actors", [1, 17])
def test_as_many_actors_as_with_gradients_take_part_though_each_has_a_rollout_under_way(actors: int) -> None:
    """Each asks for parameters before it pushes what it acted on those before, and they are taken in turns."""
    admission = Admission(replace(ROLLOUTS, max_lag=actors - 1), 1, 1, None)
    push = rollout(make_collector(ROLLOUTS))
    acted_on, fetched = [0] * actors, [0] * actors
    lags = set()
    for version in range(6 * actors):
        actor = version % actors
        assert admission.refusal(replace(push, version=acted_on[actor]), version, finished=False) is None
        lags.add(version - acted_on[actor])
        acted_on[actor], fetched[actor] = fetched[actor], version + 1
    assert max(lags) == 2 * actors - 1
    assert admission.refusal(replace(push, version=0), 2 * actors, finished=False) is not None


def test_a_repeated_rollout_counts_once() -> None:
    core = new_core()
    event = TrajectoryReceived(0, rollout(make_collector(ROLLOUTS)))
    assert isinstance(answer(core, event), Accepted)
    after = core.parameters.copy()
    assert isinstance(answer(core, event), Accepted)
    np.testing.assert_array_equal(core.parameters, after)
    assert core.version == core.statistics.duplicates == 1


def test_a_rollout_in_a_room_that_is_not_open_yet_comes_again() -> None:
    core = new_core(opened=False)
    push = rollout(make_collector(ROLLOUTS))
    for _ in range(2):
        opening, reply = core.handle(TrajectoryReceived(0, push), 0.0)
        assert opening == OpenRoom(KITCHEN)
        assert isinstance(reply, Reply)
        assert isinstance(reply.answer, Busy)
    assert core.version == 0
    core.handle(RoomOpened(VIEWS), 0.0)
    assert isinstance(answer(core, TrajectoryReceived(0, push)), Accepted)


def test_a_rollout_in_a_room_that_cannot_be_opened_is_refused() -> None:
    core, push = new_core(opened=False), rollout(make_collector(ROLLOUTS))
    core.handle(RoomUnusable(KITCHEN, "it differs"), 0.0)
    found = refused(core, push)
    assert (found.reason, found.detail) == (Reason.DIGEST, "kitchen/1 cannot be made here: it differs")


def test_only_explored_rooms_of_rollouts_that_fit_the_run_are_opened() -> None:
    core, push = new_core(opened=False), rollout(make_collector(ROLLOUTS))
    unexplored = replace(push, rooms=(RoomUsed(RoomId("kitchen", 2), "d1"),))
    assert refused(core, unexplored).reason == Reason.STALE, "an actor whose learner was started again goes on"
    other = replace(ROLLOUTS, rollout_steps=ROLLOUTS.rollout_steps + 1)
    assert refused(core, rollout(make_collector(other))).reason == Reason.SHAPE
    assert core.rooms_to_open() == [KITCHEN]


def test_rooms_are_opened_as_soon_as_an_actor_has_explored_them() -> None:
    core = new_core(opened=False)
    again = dataclasses.replace(kitchen_graph(), sequence=1)
    assert OpenRoom(KITCHEN) in core.handle(RoomGraphReceived(0, again), 0.0)
    assert core.rooms_to_open() == [KITCHEN]
    core.handle(RoomOpened(VIEWS), 0.0)
    assert core.rooms_to_open() == []
    assert OpenRoom(KITCHEN) not in core.handle(RoomGraphReceived(0, replace(again, sequence=2)), 0.0)


def test_a_resumed_run_opens_its_rooms_and_goes_on() -> None:
    core, actor = new_core(), make_collector(ROLLOUTS, max_actions=100)
    push = rollout(actor)
    answer(core, TrajectoryReceived(0, push))
    resumed = LearnerCore(ROLLOUTS, core.parameters, epoch=2, checkpoint=core.snapshot(0.0))
    assert resumed.rooms_to_open() == [KITCHEN]
    resumed.handle(RoomOpened(VIEWS), 0.0)
    assert isinstance(answer(resumed, TrajectoryReceived(0, push)), Accepted), "it counts already"
    assert resumed.version == 1
    following = rollout(actor, 1, 1, epoch=2)
    assert refused(resumed, following).reason == Reason.STALE, "the actor used a graph that this epoch did not serve"
    following = replace(following, graphs=(GraphUsed("kitchen", 2, 1),))
    assert isinstance(answer(resumed, TrajectoryReceived(0, following)), Accepted)
    assert resumed.statistics.frames < push.frames + following.frames, "nobody knows what the first episodes were at"


def test_a_gradient_is_refused_by_a_run_of_rollouts_and_the_other_way_round() -> None:
    found = refused(new_core(), gradient(0))
    assert (found.reason, found.detail) == (Reason.KIND, "this run learns from rollouts, not from gradients")
    found = refused(new_core(replace(ROLLOUTS, learn_from="gradients")), rollout(make_collector(ROLLOUTS)))
    assert (found.reason, found.detail) == (Reason.KIND, "this run learns from gradients, not from rollouts")


def test_a_rollout_of_another_epoch_or_too_old_is_refused() -> None:
    core, actor = new_core(), make_collector(ROLLOUTS)
    assert refused(core, rollout(actor, 0, epoch=2)).reason == Reason.EPOCH
    assert refused(core, rollout(actor, 1, version=1)).reason == Reason.STALE
    for version in range(ROLLOUTS.most_lag + 1):
        assert isinstance(answer(core, TrajectoryReceived(0, rollout(actor, version + 2, version))), Accepted)
    assert refused(core, rollout(actor, 9, version=0)).reason == Reason.STALE
    assert isinstance(answer(core, TrajectoryReceived(0, rollout(actor, 10, version=1))), Accepted)
    assert core.statistics.lag().maximum == ROLLOUTS.most_lag


def test_what_the_rooms_cannot_have_held_is_refused_and_does_not_count() -> None:
    core, push = new_core(), rollout(make_collector(ROLLOUTS))
    wrong = replace(push, rooms=(replace(push.rooms[0], digest="d2"),))
    assert refused(core, wrong).reason == Reason.DIGEST
    assert isinstance(answer(core, TrajectoryReceived(0, push)), Accepted)


def test_losses_are_means_over_rollouts(monkeypatch: pytest.MonkeyPatch) -> None:
    core, actor = new_core(), make_collector(ROLLOUTS)
    rollouts: Any = core._rollouts
    learn, found = rollouts.learn, []

    def noting(push: TrajectoryPush) -> Learnt:
        found.append(learn(push))
        return found[-1]  # type: ignore[no-any-return]

    monkeypatch.setattr(rollouts, "learn", noting)
    for sequence in range(3):
        answer(core, TrajectoryReceived(0, rollout(actor, sequence)))
    assert len({learnt.loss.policy for learnt in found}) == 3
    for name in ("policy_loss", "approach_loss"):
        mean = np.mean([learnt.loss.terms()[name] for learnt in found])
        assert core.statistics.losses[name] == pytest.approx(mean)


def test_losses_are_those_that_were_computed_here() -> None:
    core = new_core()
    answer(core, TrajectoryReceived(0, rollout(make_collector(ROLLOUTS))))
    losses = dict(core.statistics.losses)
    core.handle(EpisodesReceived(0, episodes(0, ("kitchen/1", True))), 0.0)
    assert core.statistics.losses == losses
    assert core.statistics.episodes == 1


def test_recorded_updates_are_repeated_in_their_order() -> None:
    records = [UpdateRecord("b", 3, 0, 0, 0, 0.5), UpdateRecord("a", 3, 0, 0, 1, 0.25)]
    core = new_core(schedule=Schedule(records))
    mine = rollout(make_collector(ROLLOUTS))
    first = replace(mine, actor="b")
    assert isinstance(answer(core, TrajectoryReceived(0, mine)), Busy)
    assert isinstance(answer(core, TrajectoryReceived(0, first)), Accepted)
    assert core.learning_rate == 0.5
    assert isinstance(answer(core, TrajectoryReceived(0, mine)), Accepted)
    assert core.learning_rate == 0.25
    assert core.finished
