"""What is fitted comes out again."""

from functools import cache

import pytest

from hoz_dist.scaling.calibration import fitted
from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.model import simulate
from tests.unit.scaling.making import costs, setting

CORES = 2


@cache
def speed(some: Costs, actors: int) -> float:
    return simulate(some, setting(actors=actors, one_host=True, cores=CORES)).frames_per_second


def test_exchange_and_crowding_are_found_from_two_runs() -> None:
    # Zenoh's threads work beside the only actor: both numbers tell in both runs.
    about = {"act": 0.3, "apply": 0.05, "actor_wire": 0.1, "switching": 0.2}
    real = costs(**about, exchange=0.01, crowding=0.3)
    found = fitted(costs(**about), CORES, speed(real, 1), speed(real, 2))
    assert found.exchange == pytest.approx(0.01, abs=0.002)
    assert found.crowding == pytest.approx(0.3, abs=0.03)
    assert found.switching == 0.2
    assert speed(found, 6) == pytest.approx(speed(real, 6), rel=0.02)
    assert (found.measured_one, found.measured_two) == (speed(real, 1), speed(real, 2))
    assert (found.modelled_one, found.modelled_two) == (speed(found, 1), speed(found, 2))


def test_runs_that_learn_from_rollouts_are_fitted_too() -> None:
    real = costs(act=0.1, apply=0.2, learn_from="rollouts", exchange=0.02, crowding=0.2)
    found = fitted(costs(act=0.1, apply=0.2, learn_from="rollouts"), CORES, speed(real, 1), speed(real, 2))
    assert found.modelled_one == pytest.approx(speed(real, 1), rel=0.01)
    assert found.modelled_two == pytest.approx(speed(real, 2), rel=0.01)


def test_runs_that_are_faster_than_their_costs_need_neither_and_are_seen_to_be_off() -> None:
    found = fitted(costs(act=0.3), CORES, one=1e6, two=1e6)
    assert (found.exchange, found.crowding) == (0.0, 0.0)
    assert found.measured_two == 1e6
    assert found.modelled_two == pytest.approx(2 * 100 / 0.3, rel=0.01)
