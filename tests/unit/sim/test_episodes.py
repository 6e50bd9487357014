import numpy as np
import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.episodes import EVALUATION_PITCHES, EpisodeSampler, episode_list
from tests.unit.sim.making import open_grid, random_views, views_of

ROOMS = [random_views(RoomId("kitchen", number), seed=number) for number in (21, 22, 23)]


def test_an_episode_starts_where_the_target_is_reachable_but_not_yet_found() -> None:
    sampler = EpisodeSampler()
    for views in ROOMS:
        sampler.add_room(views)
    rng = np.random.default_rng(0)
    for _ in range(200):
        number, episode = sampler.sample(rng)
        views = ROOMS[number]
        assert episode.room == views.room
        assert episode.target in views.targets
        assert episode.optimal == views.optimal[episode.start, episode.target] > 0
        assert views.graph.pose(episode.start).pitch == 0


def test_rooms_targets_and_starts_are_drawn_uniformly() -> None:
    sampler = EpisodeSampler()
    for views in ROOMS:
        sampler.add_room(views)
    rng = np.random.default_rng(1)
    draws = [sampler.sample(rng)[1] for _ in range(6000)]
    counts = dict.fromkeys([(views.room, target) for views in ROOMS for target in views.targets], 0)
    for episode in draws:
        counts[episode.room, episode.target] += 1
    expected = len(draws) / len(counts)
    assert all(abs(count - expected) < 6 * expected**0.5 for count in counts.values())
    valid = np.flatnonzero((ROOMS[0].optimal[:, 8] > 0) & (ROOMS[0].graph.pitch_indices == 0))
    starts = {episode.start for episode in draws if (episode.room, episode.target) == (ROOMS[0].room, 8)}
    assert starts <= set(valid.tolist())
    assert len(starts) > 0.9 * len(valid)


def test_evaluation_starts_at_both_pitches() -> None:
    pitches = {ROOMS[0].graph.pose(episode.start).pitch for episode in episode_list(ROOMS[:1], 50, 0)}
    assert pitches == set(EVALUATION_PITCHES)


def test_the_list_follows_from_rooms_and_seed() -> None:
    episodes = episode_list(ROOMS, 40, 7)
    assert len(episodes) == 40
    assert episode_list(ROOMS[::-1], 40, 7) == episodes
    assert episode_list(ROOMS, 50, 7)[:40] == episodes
    assert episode_list(ROOMS, 40, 8) != episodes
    same_content = random_views(RoomId("kitchen", 24), seed=21)
    one, other = (episode_list([views], 40, 7) for views in (ROOMS[0], same_content))
    assert [episode[1:] for episode in one] != [episode[1:] for episode in other]
    assert {episode.room for episode in episodes} == {views.room for views in ROOMS}


def test_targets_that_no_view_can_reach_are_not_asked_for() -> None:
    graph = open_grid(2, 2)
    success = np.zeros((graph.views, len(TARGETS)), dtype=np.bool_)
    success[0, 3] = True
    success[:, 5] = True  # found everywhere: nothing to search for
    views = views_of(graph, success, RoomId("kitchen", 1))
    sampler = EpisodeSampler()
    sampler.add_room(views)
    rng = np.random.default_rng(0)
    assert {sampler.sample(rng)[1].target for _ in range(20)} == {3}
    assert sampler.sample(rng, target=3)[1].target == 3
    with pytest.raises(InvalidValueError, match=r"kitchen/1 has no CoffeeMachine to search for; it has CellPhone"):
        sampler.sample(rng, target=5)


def test_a_room_without_any_episode_is_refused() -> None:
    graph = open_grid(2, 2)
    views = views_of(graph, np.zeros((graph.views, len(TARGETS)), dtype=np.bool_), RoomId("kitchen", 1))
    with pytest.raises(InvalidValueError, match="kitchen/1"):
        EpisodeSampler().add_room(views)
    with pytest.raises(InvalidValueError, match="at least one room"):
        episode_list([], 3, 0)
