"""The learner sees what an actor saw, and computes the gradient that the actor would have."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from hoz_dist.config import RunConfig
from hoz_dist.gradient_forms import Vector
from hoz_dist.nav.actions import NO_ACTION
from hoz_dist.nav.feedback import FAILED_LOOK, FAILED_MOVE
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.methods.description import Method
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.wire.protocol.codec import decode, encode
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.trajectories import Flag, GraphUsed, RoomUsed, TrajectoryPush
from learner.optimizer import FlatAdam
from learner.rollout_gradients import RolloutGradients
from tests.unit.policy.steering import CountingSteering, steer_a3c
from tests.unit.workers.making import BEDROOM, CONFIG, KITCHEN, make_collector, room_views, scene_graph
from workers.collector import Collector, Trajectory

ROOMS = (room_views(KITCHEN, 0), room_views(BEDROOM, 1))
GRAPHS = tuple(scene_graph(scene, 0) for scene in ("kitchen", "bedroom"))
USED = (GraphUsed("kitchen", 1, 1), GraphUsed("bedroom", 1, 1))
SHORT = dataclasses.replace(CONFIG, batch=12, rollout_steps=4)
LONG = 40
"""Actions after which an episode is cut off: longer than rollouts."""


def push_of(
    trajectory: Trajectory, sequence: int, graphs: tuple[GraphUsed, ...] = USED, version: int = 0
) -> TrajectoryPush:
    push = TrajectoryPush("a0", 7, sequence, 1, version, trajectory.rooms, graphs, trajectory.steps)
    return decode(encode(push), TrajectoryPush)


def learner_of(config: RunConfig = CONFIG) -> tuple[RolloutGradients, FlatAdam]:
    """What computes the gradients, and what changes its parameters."""
    adam = FlatAdam(initial_parameters(config.policy, config.seed), learning_rate=0.01)
    gradients = RolloutGradients(config)
    gradients.begin(1, adam.tensor, GRAPHS)
    for views in reversed(ROOMS):  # not in the actor's order
        gradients.add_room(views)
    return gradients, adam


def assert_close(found: Vector, expected: Vector) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=2e-5 * float(np.abs(expected).max()))


def watched(collector: Collector) -> list[Observation]:
    """Note what a collector observes from now on."""
    seen: list[Observation] = []
    env: Any = collector._env
    observe = env.observe

    def noting() -> Observation:
        seen.append(observe())
        return seen[-1]

    env.observe = noting
    return seen


def test_what_the_actor_saw_is_seen_again(monkeypatch: pytest.MonkeyPatch) -> None:
    gradients, _ = learner_of()
    actor = make_collector(CONFIG, *ROOMS)
    again: list[Observation] = []
    off_policy = gradients._differentiator.off_policy

    def noting(behaviour: Any, observation: Observation, *rest: Any) -> Any:
        again.append(observation)
        return off_policy(behaviour, observation, *rest)

    monkeypatch.setattr(gradients._differentiator, "off_policy", noting)
    for sequence in range(3):
        seen = watched(actor)
        gradients.learn(push_of(actor.record(), sequence))
        expected = Observation(*map(np.stack, zip(*seen, strict=True)))
        for name, mine, theirs in zip(Observation._fields, again[-1], expected, strict=True):
            np.testing.assert_array_equal(mine, theirs, err_msg=name)
        del actor._env.observe
    assert set(np.unique(again[-1].scene)) == {0, 2}
    previous = np.stack([observation.previous_action for observation in again])
    assert {NO_ACTION, FAILED_MOVE, FAILED_LOOK} < set(previous.ravel())


@pytest.mark.parametrize("method", ["a3c", "hoz", "savn", "org-tpn"])
def test_without_lag_the_gradients_are_the_actors_own(method: Method) -> None:
    """Over several rollouts: what one ends with, the next begins with, though it never travels.

    And with an approach that is taught less from version to version, until it is not.
    """
    config = dataclasses.replace(CONFIG, method=method, approach_frames=4 * CONFIG.rollout_steps * CONFIG.batch)
    gradients, adam = learner_of(config)
    differentiating, recording = (make_collector(config, *ROOMS, max_actions=LONG) for _ in range(2))
    graphs = USED if method == "hoz" else ()
    for sequence in range(5):
        for collector in (differentiating, recording):
            collector.load(adam.parameters, sequence)
        update, trajectory = differentiating.roll_out(), recording.record()
        learnt = gradients.learn(push_of(trajectory, sequence, graphs, version=sequence))
        assert learnt.frames == update.frames == trajectory.frames
        assert learnt.loss is not None
        assert learnt.loss.terms() == pytest.approx(update.loss.terms(), abs=1e-4)
        assert (update.loss.terms().get("approach_loss", 0.0) > 0.1) == (sequence < 4)
        assert_close(learnt.gradient, update.gradient)
        adam.step(update.gradient)  # the same for all, since Adam makes much of rounding


def test_the_learner_knows_the_experts_actions_and_the_steerings_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither travels: the one follows from the rooms, the other from the rollout before."""
    steer_a3c(monkeypatch, CountingSteering)
    config = dataclasses.replace(CONFIG, method="a3c")
    gradients, adam = learner_of(config)
    differentiating, recording = (make_collector(config, *ROOMS, max_actions=LONG) for _ in range(2))
    for sequence in range(3):
        for collector in (differentiating, recording):
            collector.load(adam.parameters, sequence)
        update, trajectory = differentiating.roll_out(), recording.record()
        learnt = gradients.learn(push_of(trajectory, sequence, (), version=sequence))
        assert learnt.loss is not None
        assert learnt.loss.imitation == pytest.approx(update.loss.imitation, abs=1e-4)
        assert update.loss.terms()["imitation_loss"] > 0.1
        assert_close(learnt.gradient, update.gradient)
        adam.step(update.gradient)


def test_of_an_unknown_state_nothing_is_learnt_until_the_next_episode_begins() -> None:
    gradients, _ = learner_of(SHORT)
    actor = make_collector(SHORT, *ROOMS, max_actions=LONG)
    actor.record()
    push = push_of(actor.record(), 1)
    steps = push.steps
    begun = np.cumsum(steps.has(Flag.FIRST)[:-1], axis=0) > 0
    assert (~begun).all(axis=0).any(), "an episode runs through all of the rollout"
    assert begun.any()
    learnt = gradients.learn(push)
    assert learnt.frames == (steps.has(Flag.VALID)[:-1] & begun).sum()
    gradient = learnt.gradient.copy()

    other, _ = learner_of(SHORT)
    reward = np.where(begun, steps.reward, np.float32(4.0))
    changed = dataclasses.replace(push, steps=dataclasses.replace(steps, reward=reward))
    np.testing.assert_array_equal(other.learn(changed).gradient, gradient)

    # Episodes that still have not begun stay unknown in the rollout after, and only they.
    following = push_of(actor.record(), 2)
    valid = following.steps.has(Flag.VALID)[:-1]
    known = begun.any(axis=0) | (np.cumsum(following.steps.has(Flag.FIRST)[:-1], axis=0) > 0)
    assert gradients.learn(following).frames == (valid & known).sum()


@pytest.mark.parametrize(("incarnation", "sequence"), [(7, 2), (8, 1)])
def test_a_rollout_that_does_not_follow_the_last_one_begins_unknown(incarnation: int, sequence: int) -> None:
    gradients, _ = learner_of()
    actor = make_collector(CONFIG, *ROOMS, max_actions=LONG)
    gradients.learn(push_of(actor.record(), 0))
    push = push_of(actor.record(), 1)
    other = dataclasses.replace(push, incarnation=incarnation, sequence=sequence)
    assert gradients.learn(other).frames < push.frames


def test_a_new_epoch_forgets_the_states_and_keeps_the_rooms() -> None:
    gradients, adam = learner_of()
    actor = make_collector(CONFIG, *ROOMS, max_actions=LONG)
    gradients.learn(push_of(actor.record(), 0))
    gradients.begin(2, adam.tensor, GRAPHS)
    used = tuple(dataclasses.replace(graph, epoch=2) for graph in USED)
    push = push_of(actor.record(), 1, used)
    assert gradients.missing(push, ()) == []
    assert gradients.learn(push).frames < push.frames


def test_rollouts_of_earlier_graphs_are_still_learnt_from() -> None:
    gradients, _ = learner_of()
    actor, same = (make_collector(CONFIG, *ROOMS) for _ in range(2))
    expected = same.roll_out().gradient
    gradients.use_graph(scene_graph("kitchen", 9, version=2))
    push = push_of(actor.record(), 0)
    assert_close(gradients.learn(push).gradient, expected)
    newer = dataclasses.replace(push, graphs=(GraphUsed("kitchen", 1, 2), USED[1]))
    assert not np.allclose(gradients.learn(newer).gradient, expected, rtol=1e-2, atol=1e-4)


def test_the_parameters_are_those_that_the_optimiser_changes() -> None:
    gradients, adam = learner_of()
    push = push_of(make_collector(CONFIG, *ROOMS).record(), 0)
    before = gradients.learn(push).gradient.copy()
    adam.step(before)
    assert not np.allclose(gradients.learn(push).gradient, before, rtol=1e-3)
    assert gradients._parameters.values.data_ptr() == adam.tensor.data_ptr(), "nothing is copied"


def altered(push: TrajectoryPush, **steps: Any) -> TrajectoryPush:
    return dataclasses.replace(push, steps=dataclasses.replace(push.steps, **steps))


def test_what_cannot_have_happened_in_these_rooms_is_refused() -> None:
    gradients, _ = learner_of()
    push = push_of(make_collector(CONFIG, *ROOMS).record(), 0)
    steps = push.steps
    elsewhere = steps.view.copy()
    elsewhere[3] ^= 1  # looks up instead of down
    zones = np.full_like(steps.subgoal, CONFIG.zones)
    half = {name: getattr(steps, name)[:, :3] for name in steps.SPECS if name != "previous_action"}
    cases = {
        Reason.DIGEST: dataclasses.replace(push, rooms=tuple(RoomUsed(one.room, "d2") for one in push.rooms)),
        Reason.STALE: dataclasses.replace(push, graphs=(GraphUsed("kitchen", 1, 5), USED[1])),
        Reason.FIELDS: dataclasses.replace(push, graphs=USED[:1]),
        Reason.SHAPE: altered(push, **half, previous_action=steps.previous_action[:3]),
    }
    for reason, wrong in cases.items():
        with pytest.raises(RejectedError) as caught:
            gradients.missing(wrong, ()) or gradients.learn(wrong)
        assert caught.value.reason == reason
    other_epoch = dataclasses.replace(push, graphs=(GraphUsed("kitchen", 2, 1), USED[1]))
    with pytest.raises(RejectedError, match="is not known"):
        gradients.learn(other_epoch)
    for wrong, what in (
        (altered(push, view=elsewhere), "does not lead"),
        (altered(push, view=np.full_like(steps.view, 60_000)), "does not have"),
        (altered(push, subgoal=zones), "do not have"),
        (altered(push, current=zones), "do not have"),
    ):
        with pytest.raises(RejectedError, match=what) as caught:
            gradients.learn(wrong)
        assert caught.value.reason == Reason.RANGE
    unknown = dataclasses.replace(push, graphs=(*USED, GraphUsed("bathroom", 9, 9)))
    assert gradients.learn(unknown).frames == push.frames, "a graph that was not used is not looked at"
    assert gradients.learn(push).frames == push.frames, "what was refused left nothing behind"
