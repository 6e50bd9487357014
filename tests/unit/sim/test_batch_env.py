import numpy as np
import pytest
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.actions import NO_ACTION, Action
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.feedback import FAILED_LOOK, FAILED_MOVE
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.room_views import RoomViews
from tests.unit.sim.making import open_grid, random_views, views_of

ROOMS = [random_views(RoomId("kitchen", 1), seed=1), random_views(RoomId("bathroom", 2), seed=2, width=3)]
OFFSETS = [0, ROOMS[0].graph.views]
FAILURES: dict[int, int] = {
    Action.MOVE_AHEAD: FAILED_MOVE,
    Action.LOOK_UP: FAILED_LOOK,
    Action.LOOK_DOWN: FAILED_LOOK,
}
"""What is felt of an action that changes nothing. Done is none that could fail so."""


def make(batch: int, seed: int = 0, rooms: list[RoomViews] = ROOMS, max_actions: int | None = None) -> BatchEnv:
    env = BatchEnv(batch, np.random.default_rng(seed), max_actions)
    for views in rooms:
        env.add_room(views)
    return env


def all_of(action: Action, batch: int) -> NDArray[np.int64]:
    return np.full(batch, int(action), dtype=np.int64)


def room_of(view: int) -> tuple[RoomViews, int]:
    number = int(view >= OFFSETS[1])
    return ROOMS[number], view - OFFSETS[number]


def test_observations_are_the_rooms_views() -> None:
    env = make(16)
    seen = env.observe()
    assert {int(scene) for scene in seen.scene} == {0, 3}
    for slot, view in enumerate(env.views.tolist()):
        views, local = room_of(view)
        assert np.array_equal(seen.features[slot], views.features[local].astype(np.float32))
        assert np.array_equal(seen.detections[slot], views.detections[local])
        assert np.array_equal(seen.appearance[slot], views.appearance[local].astype(np.float32))
        assert views.optimal[local, seen.target[slot]] > 0
    assert seen.first.all()
    assert (seen.previous_action == NO_ACTION).all()
    assert {array.dtype.name for array in seen[:3]} == {"float32"}
    assert {array.dtype.name for array in seen[3:6]} == {"int64"}


def test_steps_against_a_plain_loop_over_episodes() -> None:
    """The batch does what a loop over slots, poses and the reward's definition does."""
    batch, cap = 8, 9
    env = make(batch, max_actions=cap)
    rng = np.random.default_rng(5)
    seen = env.observe()
    actions_taken, moves, waiting = [0] * batch, [0] * batch, [False] * batch
    optimal = [int(room_of(view)[0].optimal[room_of(view)[1], seen.target[b]]) for b, view in enumerate(env.views)]
    ended = 0
    felt: set[int] = set()
    for _ in range(300):
        before, target = env.views.copy(), env.observe().target
        actions = rng.choice(6, size=batch, p=[0.3, 0.2, 0.2, 0.1, 0.1, 0.1])
        step = env.step(actions)
        finished: list[EpisodeResult] = []
        for slot in range(batch):
            views, local = room_of(int(before[slot]))
            assert step.valid[slot] == (not waiting[slot])
            if waiting[slot]:
                assert (step.reward[slot], step.terminated[slot], step.truncated[slot]) == (0.0, False, False)
                fresh, at = room_of(int(env.views[slot]))
                optimal[slot] = int(fresh.optimal[at, env.observe().target[slot]])
                assert env.observe().first[slot]
                actions_taken[slot], moves[slot], waiting[slot] = 0, 0, False
                continue
            actions_taken[slot] += 1
            moves[slot] += int(actions[slot] == Action.MOVE_AHEAD)
            done = bool(actions[slot] == Action.DONE)
            success = done and bool(views.success[local, target[slot]])
            over = done or actions_taken[slot] == cap
            assert step.reward[slot] == np.float32(-0.01) + np.float32(5.0 if success else 0.0)
            assert step.terminated[slot] == done
            assert step.truncated[slot] == (over and not done)
            expected = views.graph.transitions[local, actions[slot]]
            assert room_of(int(env.views[slot])) == (views, expected)
            feels = FAILURES.get(int(actions[slot]), actions[slot]) if expected == local else actions[slot]
            assert env.observe().previous_action[slot] == feels
            felt.add(int(feels))
            assert not env.observe().first[slot]
            waiting[slot] = over
            if over:
                finished.append(
                    EpisodeResult(
                        views.room,
                        int(target[slot]),
                        success,
                        actions_taken[slot],
                        moves[slot],
                        done,
                        optimal[slot],
                    )
                )
        assert step.finished == finished
        ended += len(finished)
    assert ended > 100
    assert felt == {*Action, FAILED_MOVE, FAILED_LOOK}


def test_what_is_in_the_way_and_where_the_camera_ends_is_felt() -> None:
    """In a room of one position there is nowhere to go, and the camera has but two pitches."""
    graph = open_grid(1, 1)
    success = np.zeros((graph.views, len(TARGETS)), dtype=np.bool_)
    success[:, 4] = np.arange(graph.views) != 0  # so that the episode begins at view 0, which looks straight ahead
    env = make(1, rooms=[views_of(graph, success, RoomId("kitchen", 1))])
    expected = [
        (Action.LOOK_DOWN, Action.LOOK_DOWN),
        (Action.LOOK_DOWN, FAILED_LOOK),
        (Action.MOVE_AHEAD, FAILED_MOVE),
        (Action.ROTATE_LEFT, Action.ROTATE_LEFT),
        (Action.LOOK_UP, Action.LOOK_UP),
        (Action.LOOK_UP, FAILED_LOOK),
        (Action.DONE, Action.DONE),
        (Action.MOVE_AHEAD, NO_ACTION),  # another episode begins
    ]
    env.observe()
    for action, felt in expected:
        env.step(all_of(action, 1))
        assert env.observe().previous_action.tolist() == [felt]


def test_the_last_observation_of_a_truncated_episode_is_seen() -> None:
    env = make(1, max_actions=1)
    start = env.observe()
    turned = int(ROOMS[0].graph.transitions[0, Action.ROTATE_LEFT])
    assert turned != 0
    step = env.step(all_of(Action.ROTATE_LEFT, 1))
    assert step.truncated[0]
    last = env.observe()
    assert not np.array_equal(last.features, start.features)
    assert last.target == start.target
    assert not last.first[0]
    reset = env.step(all_of(Action.DONE, 1))
    assert not reset.valid[0]
    assert reset.finished == []
    assert env.observe().first[0]


def test_done_at_a_pose_that_succeeds() -> None:
    graph = open_grid(1, 1)
    success = np.zeros((graph.views, len(TARGETS)), dtype=np.bool_)
    success[:, 4] = np.arange(graph.views) != 0
    env = make(1, rooms=[views_of(graph, success, RoomId("living_room", 1))])
    env.observe()
    assert env.views[0] == 0
    assert env.step(all_of(Action.ROTATE_LEFT, 1)).reward[0] == np.float32(-0.01)
    step = env.step(all_of(Action.DONE, 1))
    assert step.reward[0] == pytest.approx(4.99)
    assert step.terminated[0]
    assert step.finished == [EpisodeResult(RoomId("living_room", 1), 4, True, 2, 0, True, 1)]


@pytest.mark.parametrize(("scene", "cap"), [("kitchen", 100), ("living_room", 200)])
def test_without_a_cap_the_scenes_own_holds(scene: str, cap: int) -> None:
    env = make(2, rooms=[random_views(RoomId(scene, 1))])
    steps = [env.step(all_of(Action.LOOK_UP, 2)) for _ in range(cap)]
    assert not any(step.truncated.any() for step in steps[:-1])
    assert steps[-1].truncated.all()
    assert {result.actions for result in steps[-1].finished} == {cap}


def test_a_room_may_come_later() -> None:
    env = make(32, rooms=ROOMS[:1], max_actions=2)
    assert set(env.observe().scene.tolist()) == {0}
    env.add_room(ROOMS[1])
    assert set(env.observe().scene.tolist()) == {0}
    for _ in range(3):
        env.step(all_of(Action.LOOK_UP, 32))
    assert set(env.observe().scene.tolist()) == {0, 3}


def test_without_rooms_nothing_can_be_observed() -> None:
    env = BatchEnv(2, np.random.default_rng(0))
    with pytest.raises(InvalidValueError, match="add a room"):
        env.observe()
    with pytest.raises(InvalidValueError, match="add a room"):
        env.step(all_of(Action.DONE, 2))


def test_the_seed_decides_everything() -> None:
    def run(seed: int) -> list[NDArray[np.int64]]:
        env, rng = make(6, seed, max_actions=7), np.random.default_rng(0)
        trace = []
        for _ in range(40):
            env.step(rng.integers(6, size=6))
            trace.append(env.views.copy())
        return trace

    assert np.array_equal(run(1), run(1))
    assert not np.array_equal(run(1), run(2))


def test_places_tell_what_is_observed() -> None:
    env = BatchEnv(8, np.random.default_rng(0))
    rooms = [random_views(RoomId("kitchen", number), seed=number) for number in (1, 2)]
    for views in rooms:
        env.add_room(views)
    for action in (0, 1, 5, 2):
        observation, places = env.observe(), env.places()
        for slot, (room, view) in enumerate(zip(*places, strict=True)):
            np.testing.assert_array_equal(observation.detections[slot], env.rooms[room].detections[view])
        env.step(np.full(8, action))
        assert len(set(places.room)) == 2
