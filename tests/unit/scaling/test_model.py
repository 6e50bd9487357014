"""The model where one can tell by hand what comes of it."""

import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.scaling.model import simulate
from hoz_dist.scaling.setting import Prediction
from tests.unit.scaling.making import costs, setting

ALL = {
    "act": 0.5,
    "differentiate": 0.25,
    "load": 0.01,
    "push": 0.02,
    "fetch": 0.03,
    "receive": 0.05,
    "apply": 0.06,
    "publish": 0.07,
    "serve": 0.08,
    "record": 0.0,  # while the actor goes on
}


def test_one_actor_alone_takes_the_sum_of_all_costs_and_delays() -> None:
    found = simulate(costs(**ALL, exchange=0.1), setting(latency=0.05))
    # Two questions: a push and a fetch in one part.
    assert 1.0 / found.updates_per_second == pytest.approx(sum(ALL.values()) + 2 * (0.1 + 2 * 0.05))
    assert found.frames_per_second == pytest.approx(100 * found.updates_per_second)
    assert (found.lag, found.stale, found.busy, found.resent) == (0.0, 0.0, 0.0, 0.0)


def test_parts_of_the_parameters_are_asked_for_two_at_once_but_the_first() -> None:
    # 79 parts: one alone, and 39 times two.
    found = simulate(costs(act=1.0, parameters=9_600_000), setting(latency=0.01))
    assert 1.0 / found.updates_per_second == pytest.approx(1.0 + 0.02 + (1 + 39) * 0.02)
    # 20 parts of a quarter of the bytes: one alone, and 9.5 times two.
    found = simulate(costs(act=1.0, parameters=9_600_000, parameters_form="delta"), setting(latency=0.01))
    assert 1.0 / found.updates_per_second == pytest.approx(1.0 + 0.02 + (1 + 9.5) * 0.02)


def test_parts_that_take_long_are_asked_for_one_by_one() -> None:
    found = simulate(costs(act=1.0, parameters=9_600_000), setting(latency=0.03))
    assert 1.0 / found.updates_per_second == pytest.approx(1.0 + 0.06 + 79 * 0.06)


def test_a_part_of_the_parameters_is_taken_in_while_the_next_is_served() -> None:
    # Five parts, 0.02 s to serve and to take in: the first, and then each two in turns.
    found = simulate(costs(act=1.0, serve=0.1, fetch=0.1, parameters=600_000), setting())
    assert 1.0 / found.updates_per_second == pytest.approx(1.0 + 0.04 + (2 * 2 + 1) * 0.02)


def test_zenohs_threads_take_cores_but_nobody_waits_for_them() -> None:
    busy = costs(act=1.0, actor_wire=0.5, learner_wire=0.5)
    assert simulate(busy, setting(one_host=True, cores=8)).updates_per_second == pytest.approx(1.0)
    assert simulate(busy, setting(one_host=True, cores=1)).updates_per_second == pytest.approx(0.5, rel=0.1)


def test_the_interpreter_lock_alone_does_not_slow_one_actor_down() -> None:
    assert simulate(costs(**ALL, gil=1.0), setting()).updates_per_second == pytest.approx(
        simulate(costs(**ALL), setting()).updates_per_second
    )


def test_actors_that_share_a_core_share_its_time() -> None:
    found = simulate(costs(act=0.5), setting(actors=3, one_host=True, cores=1))
    assert found.updates_per_second == pytest.approx(2.0, rel=0.02)
    assert found.host_load == pytest.approx(1.0)
    assert found.bottleneck == "actor"


def test_actors_with_a_core_of_their_own_are_not_crowded() -> None:
    found = simulate(costs(act=0.5, crowding=0.6), setting(actors=4))
    assert found.updates_per_second == pytest.approx(4 * 2.0, rel=0.01)


def test_on_one_host_there_is_no_network() -> None:
    slow = {"bandwidth": 1e3, "latency": 10.0}
    some = costs(act=0.5, parameters=200_000)
    assert simulate(some, setting(one_host=True, **slow)) == simulate(some, setting(one_host=True))
    assert simulate(some, setting(one_host=True)).updates_per_second == pytest.approx(2.0)


def test_crowded_cores_are_slower_and_a_core_alone_is_not() -> None:
    crowded = costs(act=0.5, crowding=0.25)
    assert simulate(crowded, setting(one_host=True, cores=2)).updates_per_second == pytest.approx(2.0)
    found = simulate(crowded, setting(actors=2, one_host=True, cores=2))
    assert found.updates_per_second == pytest.approx(2 * 2.0 / 1.25, rel=0.02)


@pytest.mark.parametrize(("actors", "slower"), [(1, 1.0), (2, 1.25), (3, 1.25 * 1.2), (8, 1.25 * 1.2)])
def test_processes_that_take_turns_are_slower_than_those_that_fill_the_cores(actors: int, slower: float) -> None:
    some = costs(act=0.5, crowding=0.25, switching=0.2)
    found = simulate(some, setting(actors=actors, one_host=True, cores=2))
    assert found.updates_per_second == pytest.approx(min(actors, 2) * 2.0 / slower, rel=0.02)


def test_a_learner_applies_no_more_than_its_thread_can() -> None:
    found = simulate(costs(act=1.0, apply=0.03, publish=0.02), setting(actors=100))
    assert found.updates_per_second == pytest.approx(1 / 0.05, rel=0.02)
    assert found.apply_load == pytest.approx(1.0, abs=0.01)
    assert found.bottleneck == "apply"


@pytest.mark.parametrize(("gil", "updates"), [(0.0, 1 / 0.05), (1.0, 1 / 0.09)])
def test_the_interpreter_lock_makes_the_learners_threads_take_turns(gil: float, updates: float) -> None:
    found = simulate(costs(act=0.5, receive=0.04, apply=0.05, gil=gil), setting(actors=30))
    assert found.updates_per_second == pytest.approx(updates, rel=0.05)
    assert (found.gil_wait > 0.1) == (gil == 1.0)


def test_a_full_link_carries_what_its_bandwidth_allows() -> None:
    # 4000 bytes a gradient are 32,000 bits; parameters come the other way.
    found = simulate(costs(act=0.01), setting(actors=50, bandwidth=1e6))
    assert found.updates_per_second == pytest.approx(1e6 / 32_000, rel=0.03)
    assert found.megabits_up == pytest.approx(1.0, rel=0.03)
    assert found.bottleneck in {"up", "down"}


def test_a_link_on_which_nothing_comes_in_time_carries_no_less() -> None:
    # Each of 30 gradients takes 40 s when all are under way, four times as long as the first answer is waited for.
    found = simulate(costs(act=0.01), setting(actors=30, bandwidth=30 * 32_000 / 40))
    assert found.updates_per_second > 0.7 * 30 / 40
    assert found.megabits_up == pytest.approx(0.024, rel=0.1)
    assert found.resent < 0.4


def test_what_one_actor_asks_for_does_not_come_faster_than_its_link_is() -> None:
    # 4 MB up and down, 128 Mbit/s for the actor, as much as one wants for the learner; two parts are under way at once.
    some = costs(act=0.1, parameters=1_000_000)
    found = simulate(some, setting(bandwidth=128e6, learner_bandwidth=1e12))
    assert 1.0 / found.updates_per_second == pytest.approx(0.1 + 2 * 0.25)


def test_fewer_bytes_go_over_the_same_link_more_often() -> None:
    measured = costs(act=0.01)
    few = measured.adapted(compress="int8", parameters_form="delta")
    full = simulate(measured, setting(actors=50, bandwidth=1e6)).updates_per_second
    assert simulate(few, setting(actors=50, bandwidth=1e6)).updates_per_second == pytest.approx(4 * full, rel=0.15)


def test_the_inbox_is_bounded_and_the_others_are_told_to_come_again() -> None:
    few, many = (simulate(costs(act=0.1, apply=0.1), setting(actors=actors)) for actors in (30, 45))
    assert few.busy == 0.0
    assert many.busy > 0.1
    assert many.updates_per_second == pytest.approx(10.0, rel=0.02)


def test_who_has_waited_too_long_is_told_to_come_again() -> None:
    assert simulate(costs(act=1.0, apply=1.0), setting(actors=5)).busy == 0.0
    assert simulate(costs(act=1.0, apply=1.0), setting(actors=10)).busy > 0.1


def test_the_lag_is_the_number_of_the_other_actors() -> None:
    lags = [simulate(costs(act=1.0, apply=0.001), setting(actors=actors)).lag for actors in (1, 5, 20)]
    assert lags == pytest.approx([0, 4, 19], abs=0.5)


def test_gradients_that_are_too_stale_are_refused() -> None:
    found = simulate(costs(act=1.0, apply=0.001), setting(actors=40, max_lag=9))
    assert found.stale == pytest.approx(0.75, abs=0.03)
    assert found.lag_max <= 9


def test_rollouts_may_be_about_twice_as_stale() -> None:
    found = simulate(costs(act=1.0, apply=0.001, learn_from="rollouts"), setting(actors=40, max_lag=9))
    assert 9 < found.lag_max <= 19


def test_shards_divide_what_depends_on_the_size() -> None:
    slow = costs(act=0.1, apply=0.1, fixed=0.002)
    found = simulate(slow, setting(actors=100, shards=10))
    assert found.updates_per_second == pytest.approx(1 / (0.002 + 0.098 / 10), rel=0.03)


def test_relays_spare_the_learner_the_actors() -> None:
    slow = costs(act=1.0, apply=0.05)
    alone = simulate(slow, setting(actors=100))
    helped = simulate(slow, setting(actors=100, fan_out=10))
    assert alone.updates_per_second == pytest.approx(1 / 0.05, rel=0.02)
    assert alone.relay_load is None
    assert helped.frames_per_second == pytest.approx(100 * 100 / 1.0, rel=0.1)
    assert helped.lag < alone.lag
    assert helped.relay_load is not None


def test_relays_bring_more_frames_of_fewer_updates() -> None:
    found = simulate(costs(act=1.0, apply=0.05), setting(actors=100, fan_out=10))
    assert found.updates_per_second == pytest.approx(20, rel=0.05)
    assert found.frames_per_second > 9000
    # What the actors push to the relays is none of what arrives at the learner.
    assert found.megabits_up == pytest.approx(32_000 * found.updates_per_second / 1e6, rel=0.05)


def test_a_run_that_stands_still_says_so() -> None:
    found = simulate(costs(act=1.0, parameters=1_000_000), setting(bandwidth=1e3))  # nine hours for each gradient
    assert not found.gets_on
    assert found.frames_per_second == 0.0


def test_a_run_that_is_slow_is_measured_to_its_end() -> None:
    # 32 s for each gradient: 200 of them take hours.
    found = simulate(costs(act=1.0), setting(bandwidth=1e3, actors=3))
    assert found.gets_on
    assert found.updates_per_second == pytest.approx(1 / 32, rel=0.3)
    assert found.simulated_seconds > 2 * 3600


def test_relays_stand_in_as_many_levels_as_it_takes() -> None:
    assert setting(actors=100).relays == ()
    assert setting(actors=10, fan_out=10).relays == ()
    assert setting(actors=11, fan_out=10).relays == (2,)
    assert setting(actors=1000, fan_out=10).relays == (10, 100)
    assert setting(actors=1001, fan_out=10).relays == (2, 11, 101)


def test_one_seed_gives_one_result() -> None:
    crowd, slow = setting(actors=60), costs(act=0.2, apply=0.05)
    once = simulate(slow, crowd, seed=3)
    assert simulate(slow, crowd, seed=3) == once
    assert simulate(slow, crowd, seed=4) != once


def test_progress_ends_with_all() -> None:
    told: list[float] = []
    simulate(costs(act=1.0), setting(actors=3), progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_the_next_rollout_is_acted_while_the_learner_learns_from_the_last() -> None:
    found = simulate(costs(act=1.0, apply=0.8, learn_from="rollouts"), setting())
    assert found.updates_per_second == pytest.approx(1.0)
    assert found.lag == 1.0


def test_rollouts_have_neither_shards_nor_relays() -> None:
    rollouts = costs(act=1.0, learn_from="rollouts")
    for design in ({"shards": 2}, {"fan_out": 2}):
        with pytest.raises(InvalidValueError, match="need gradients"):
            simulate(rollouts, setting(actors=4, **design))


def test_what_is_fullest_is_named_and_nothing_when_all_wait() -> None:
    assert simulate(costs(act=1.0), setting()).bottleneck == "actor"
    found: Prediction = simulate(costs(act=1.0), setting(latency=5.0))
    assert found.bottleneck == "waiting"
    assert found.to_json()["bottleneck"] == "waiting"
