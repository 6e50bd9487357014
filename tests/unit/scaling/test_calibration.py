"""What is fitted comes out again."""

import pytest

from hoz_dist.scaling.calibration import fitted
from hoz_dist.scaling.model import simulate
from tests.unit.scaling.making import costs, setting

CORES = 2


def speed(some: object, actors: int) -> float:
    return simulate(some, setting(actors=actors, one_host=True, cores=CORES)).frames_per_second  # type: ignore[arg-type]


def test_exchange_and_crowding_are_found_from_two_runs() -> None:
    real = costs(act=0.3, apply=0.05, round_trips=2, exchange=0.01, crowding=0.3)
    found = fitted(costs(act=0.3, apply=0.05, round_trips=2), CORES, speed(real, 1), speed(real, 2))
    assert found.exchange == pytest.approx(0.01, rel=0.01)
    assert found.crowding == pytest.approx(0.3, abs=0.02)
    assert speed(found, 6) == pytest.approx(speed(real, 6), rel=0.02)


def test_runs_that_are_faster_than_their_costs_need_neither() -> None:
    found = fitted(costs(act=0.3), CORES, one=1e6, two=1e6)
    assert (found.exchange, found.crowding) == (0.0, 0.0)
