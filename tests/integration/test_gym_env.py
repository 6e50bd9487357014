"""The Gymnasium environment keeps Gymnasium's contract and hoz-dist's protocol."""

from importlib.metadata import entry_points
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from hoz_dist.errors import HozError
from hoz_dist.nav.actions import NO_ACTION, Action
from hoz_dist.nav.categories import SCENES, TARGETS
from hoz_dist.nav.episode import evaluation_cap
from hoz_dist.nav.feedback import FAILED_LOOK, FAILED_MOVE, PREVIOUS_ACTIONS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.gym_env import NoFeatures, ObjectNavEnv
from hoz_dist.sim.registration import ENVIRONMENT_ID, register
from hoz_dist.sim.view_store import ViewStore
from tests.integration.seeing import SIDE

pytestmark = pytest.mark.integration

ROOM = "bathroom/1"


def make(cache: Path, **options: Any) -> ObjectNavEnv:
    env = gymnasium.make(ENVIRONMENT_ID, **{"rooms": ROOM, "picture_size": SIDE, "cache": cache, **options}).unwrapped
    assert isinstance(env, ObjectNavEnv)
    return env


@pytest.mark.parametrize("live", [False, True])
def test_gymnasiums_own_check_passes_without_a_warning(cache: Path, live: bool) -> None:
    env = make(cache, live=live, render_mode="rgb_array")
    check_env(env)
    env.close()
    env.close()


def test_it_can_be_made_by_module_and_name(cache: Path) -> None:
    register()  # again: no warning
    env = gymnasium.make(f"hoz_dist.sim.registration:{ENVIRONMENT_ID}", rooms=ROOM, picture_size=SIDE, cache=cache)
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    env.close()


def test_the_declared_entry_point_registers_it() -> None:
    declared = entry_points(group="gymnasium.envs")
    if "hoz_dist" not in declared.names:
        pytest.skip("hoz-dist is not installed, only importable")
    declared["hoz_dist"].load()()
    assert ENVIRONMENT_ID in gymnasium.registry


def test_the_description_has_the_spaces_and_caps_of_the_code() -> None:
    described = ObjectNavEnv.__doc__ or ""
    assert f"| `previous_action` | `Discrete({PREVIOUS_ACTIONS})`" in described
    for scene in SCENES:
        named = f"in {scene.replace('_', ' ')}s" if evaluation_cap(scene) != evaluation_cap("kitchen") else "by default"
        assert f"{named} {evaluation_cap(scene)}" in described


def test_an_oracle_is_rewarded_as_the_protocol_says(cache: Path) -> None:
    env = make(cache)
    views = ViewStore(cache, SIDE).open(RoomId.parse(ROOM), NoFeatures())
    for seed in range(3):
        observation, info = env.reset(seed=seed)
        target = int(observation["target"])
        optimal = views.optimal[:, target]
        assert (TARGETS[target], ROOM) == (info["target"], info["room"])
        assert observation["previous_action"] == NO_ACTION
        for left in range(info["optimal"], 0, -1):
            view = views.graph.view_of(info["pose"])
            assert optimal[view] == left
            assert np.array_equal(observation["detections"], views.detections[view])
            action = np.flatnonzero(optimal[views.graph.transitions[view]] == left - 1)[0]
            observation, reward, terminated, truncated, info = env.step(action)
            assert (reward, terminated, truncated, info["success"]) == (-0.01, False, False, False)
            assert observation["previous_action"] == action
        _, reward, terminated, truncated, info = env.step(np.int64(Action.DONE))
        assert (terminated, truncated, info["success"]) == (True, False, True)
        assert reward == pytest.approx(4.99)
        with pytest.raises(ResetNeeded):
            env.step(np.int64(Action.DONE))
    env.close()


def test_the_cap_truncates_and_a_failed_done_terminates(cache: Path) -> None:
    env = make(cache, max_actions=3)
    env.reset(seed=0)
    ends = [env.step(np.int64(Action.LOOK_UP))[2:4] for _ in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]
    env.reset()
    _, reward, terminated, truncated, info = env.step(np.int64(Action.DONE))
    assert (reward, terminated, truncated, info["success"]) == (-0.01, True, False, False)
    env.close()


def test_what_fails_is_felt(cache: Path) -> None:
    env = make(cache, max_actions=200)
    rng = np.random.default_rng(0)
    _, info = env.reset(seed=0)
    failed = {Action.MOVE_AHEAD: FAILED_MOVE, Action.LOOK_UP: FAILED_LOOK, Action.LOOK_DOWN: FAILED_LOOK}
    felt = set()
    for action in rng.choice(5, size=100, p=[0.4, 0.2, 0.2, 0.1, 0.1]):
        before = info["pose"]
        observation, *_, info = env.step(action)
        expected = failed[Action(action)] if info["pose"] == before else action
        assert observation["previous_action"] == expected
        assert env.observation_space.contains(observation)
        felt.add(int(expected))
    assert felt == {*range(5), FAILED_MOVE, FAILED_LOOK}
    env.close()


def test_live_and_stored_show_the_same(cache: Path) -> None:
    stored, live = make(cache), make(cache, live=True)
    rng = np.random.default_rng(0)
    stored.reset(seed=5)
    live.reset(seed=5)
    for action in rng.integers(5, size=25):
        one, other = stored.step(action), live.step(action)
        for key, value in one[0].items():
            assert np.array_equal(value, other[0][key]), key
        assert one[1:] == other[1:]
    stored.close()
    live.close()


def test_the_seed_decides_and_options_choose(cache: Path) -> None:
    env = make(cache)
    infos = [env.reset(seed=seed)[1] for seed in (1, 1, 2, 3, 4)]
    assert infos[0] == infos[1]
    assert any(one != other for one, other in pairwise(infos[1:]))
    _, info = env.reset(seed=1, options={"room": "bathroom/3", "target": "sink"})
    assert (info["room"], info["target"]) == ("bathroom/3", "Sink")
    with pytest.raises(HozError, match=r"bathroom/1 has no Fridge"):
        env.reset(options={"target": "Fridge"})
    env.close()


def test_gymnasiums_vector_environments_take_it(cache: Path) -> None:
    vector = gymnasium.make_vec(
        ENVIRONMENT_ID, num_envs=2, vectorization_mode="sync", rooms=ROOM, picture_size=SIDE, cache=cache
    )
    assert vector.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert ObjectNavEnv.metadata["autoreset_mode"] is AutoresetMode.DISABLED
    observation, _ = vector.reset(seed=0)
    assert observation["rgb"].shape == (2, SIDE, SIDE, 3)
    vector.step(np.array([Action.DONE, Action.LOOK_UP]))
    vector.close()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rooms": "garage"}, "Unknown scene 'garage'"),
        ({"rooms": "bathroom/99"}, "Unknown room"),
        ({"rooms": ()}, "at least one room"),
        ({"split": "dev"}, "Unknown split 'dev'"),
        ({"max_actions": 0}, "at least 1 action"),
    ],
)
def test_wrong_arguments_are_one_sentence(cache: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(HozError, match=words):
        ObjectNavEnv(cache=cache, **{"rooms": ROOM, **options})
