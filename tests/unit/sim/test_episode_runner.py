from itertools import pairwise

import numpy as np
import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.actions import Action
from hoz_dist.nav.episode import Episode
from hoz_dist.nav.metrics import metrics_of
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.episode_runner import EpisodeRunner
from hoz_dist.sim.episodes import episode_list
from tests.unit.sim.making import random_views

ROOMS = [random_views(RoomId("kitchen", number), seed=number) for number in (21, 22)]
BY_ROOM = {views.room: views for views in ROOMS}


def best_action(episode: Episode, view: int) -> int:
    """Take a step that brings the target nearer, or say Done."""
    views = BY_ROOM[episode.room]
    optimal = views.optimal[:, episode.target]
    if views.success[view, episode.target]:
        return Action.DONE
    return int(np.flatnonzero(optimal[views.graph.transitions[view]] == optimal[view] - 1)[0])


def test_the_optimal_path_gives_full_marks_and_its_own_length() -> None:
    episodes = episode_list(ROOMS, 30, 0)
    runner = EpisodeRunner(ROOMS, episodes)
    while runner.active.any():
        actions = [best_action(e, int(v)) for e, v in zip(episodes, runner.local_views, strict=True)]
        runner.step(np.array(actions))
    results = runner.results()
    assert [(r.room, r.target, r.optimal) for r in results] == [(e.room, e.target, e.optimal) for e in episodes]
    assert [result.actions - 1 for result in results] == [episode.optimal for episode in episodes]
    assert metrics_of(results)[1:3] == (1.0, 1.0)


def test_every_episode_counts_in_the_order_of_the_list() -> None:
    """Long episodes are not left out because short ones end first."""
    episodes = episode_list(ROOMS, 12, 1)
    runner = EpisodeRunner(ROOMS, episodes, max_actions=20)
    stop_at = np.arange(12) % 6 * 5
    for step in range(20):
        with pytest.raises(RuntimeError, match="active"):
            runner.results()
        runner.step(np.where(step >= stop_at, int(Action.DONE), int(Action.ROTATE_LEFT)))
        assert runner.active.tolist() == [step < at and step < 19 for at in stop_at]
    last = [Action.DONE if at < 20 else Action.ROTATE_LEFT for at in stop_at]
    assert runner.observe().previous_action.tolist() == last
    runner.step(np.full(12, int(Action.LOOK_DOWN)))
    assert runner.observe().previous_action.tolist() == last
    results = runner.results()
    assert [result.actions for result in results] == [min(at + 1, 20) for at in stop_at]
    assert [result.said_done for result in results] == [bool(at < 20) for at in stop_at]
    assert [(result.room, result.target) for result in results] == [(e.room, e.target) for e in episodes]


def test_trajectories_hold_each_episodes_views() -> None:
    episodes = episode_list(ROOMS, 8, 2)
    runner = EpisodeRunner(ROOMS, episodes, max_actions=15)
    rng = np.random.default_rng(0)
    while runner.active.any():
        runner.step(rng.choice(6, size=8, p=[0.4, 0.2, 0.2, 0.05, 0.05, 0.1]))
    for episode, result, views in zip(episodes, runner.results(), runner.trajectories(), strict=True):
        transitions = BY_ROOM[episode.room].graph.transitions
        assert views[0] == episode.start
        assert len(views) == result.actions + 1
        assert all(after in transitions[before] for before, after in pairwise(views))


def test_an_episode_in_a_room_that_is_not_there_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="kitchen/22"):
        EpisodeRunner(ROOMS[:1], [Episode(RoomId("kitchen", 22), 0, 2, 1)])
