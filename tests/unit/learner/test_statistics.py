from dataclasses import replace

import pytest

from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.pushes import EpisodesPush
from hoz_dist.wire.protocol.rejection import RejectedError
from learner.core import LearnerCore
from learner.events import EpisodesReceived
from learner.statistics import MAX_ACTORS, SUCCESS_WINDOW, LagSummary, Rate, Statistics
from tests.unit.learner.making import CONFIG, answer, episodes, vector


def test_a_steady_rate_is_measured() -> None:
    rate = Rate()
    for second in range(100):
        rate.add(1000.0 + second, 50)
    assert rate.per_second(1100.0) == pytest.approx(50.0, rel=0.05)


def test_a_rate_falls_to_zero_when_nothing_comes() -> None:
    rate = Rate()
    rate.add(5.0, 300)
    assert rate.per_second(6.0) == 300.0
    assert rate.per_second(15.0) == 30.0
    assert rate.per_second(100.0) == 0.0


def test_success_is_that_of_the_last_thousand_episodes() -> None:
    statistics = Statistics()
    for _ in range(500):
        statistics.finished("kitchen", success=False)
    for _ in range(SUCCESS_WINDOW - 250):
        statistics.finished("bedroom", success=True)
    success = statistics.success()
    assert success == {"episodes": 1000, "overall": 0.75, "scenes": {"bedroom": 1.0, "kitchen": 0.0}}
    assert statistics.episodes == 1250


def test_no_episodes_have_no_success_rate() -> None:
    assert Statistics().success() == {"episodes": 0, "overall": None, "scenes": {}}


def test_lag_is_summed_up() -> None:
    statistics = Statistics()
    assert statistics.lag() == LagSummary(0, 0.0, 0)
    for lag in (1, 3, 8):
        statistics.applied("a", 7, 20, lag, now=1.0)
    assert statistics.lag() == LagSummary(1, 4.0, 8)
    assert statistics.frames == 60
    assert statistics.actors["a", 7].summary(now=3.5) == {
        "rooms": [],
        "frames": 60,
        "frames_per_second": 24.0,
        "lag": 4.0,
        "last_seen_seconds": 2.5,
    }


def test_actors_are_forgotten_when_there_are_too_many() -> None:
    statistics = Statistics()
    for number in range(MAX_ACTORS + 1):
        statistics.actor(f"a{number}", 1, now=float(number))
    assert len(statistics.actors) == MAX_ACTORS
    assert ("a0", 1) not in statistics.actors


def test_a_name_that_invents_incarnations_pushes_out_only_its_own() -> None:
    statistics = Statistics()
    statistics.applied("honest", 1, 20, lag=0, now=0.0)
    for incarnation in range(2 * MAX_ACTORS):
        statistics.actor("mallory", incarnation, now=1.0)
    assert len(statistics.actors) == MAX_ACTORS
    assert statistics.actors["honest", 1].frames == 20
    assert ("mallory", 2 * MAX_ACTORS - 1) in statistics.actors


@pytest.mark.parametrize("room", [RoomId("kitchen", 0), RoomId("kitchen", 31), RoomId("cellar", 1)], ids=str)
def test_the_rooms_of_an_actor_are_rooms_that_exist(room: RoomId) -> None:
    result = EpisodeResult(room, 0, False, 12, 6, True, 8)
    with pytest.raises(RejectedError):
        EpisodesPush(actor="a", incarnation=1, sequence=0, episodes=(result,))


def test_the_speed_of_a_process_is_not_that_of_its_predecessor() -> None:
    statistics = Statistics()
    statistics.applied("a", 7, 3000, lag=4, now=1.0)
    statistics.applied("a", 8, 60, lag=0, now=2.0)
    successor = statistics.actors["a", 8].summary(now=3.0)
    assert (successor["frames"], successor["frames_per_second"], successor["lag"]) == (60, 60.0, 0.0)
    assert statistics.frames == 3060


def test_the_status_has_the_losses_that_an_actor_told_of() -> None:
    core = LearnerCore(CONFIG, vector(0))
    assert core.status(0.0)["losses"] == {}
    told = {"policy_loss": -0.5, "value_loss": 0.25, "entropy": 1.5, "scene_loss": 0.0, "approach_loss": 0.75}
    answer(core, EpisodesReceived(0, replace(episodes(0), **told)))  # type: ignore[arg-type]
    assert core.status(0.0)["losses"] == told
    answer(core, EpisodesReceived(0, replace(episodes(1), imitation_loss=0.125)))
    assert set(core.status(0.0)["losses"]) == {"policy_loss", "value_loss", "entropy", "scene_loss", "imitation_loss"}
