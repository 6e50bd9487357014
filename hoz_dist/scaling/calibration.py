"""Fits what cannot be measured by itself, so that the model does what runs of one and two actors did."""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from scipy.optimize import brentq

from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.model import simulate
from hoz_dist.scaling.setting import Setting

MOST_CROWDING: Final = 4.0
NEAR: Final = 0.005
"""Share by which the model may be off; runs of the same programs differ by more."""
_ROUNDS: Final = 4
_EXACT: Final = 1e-3
"""Relative error of a fitted number."""


def fitted(costs: Costs, cores: int, one: float, two: float) -> Costs:
    """Return costs with ``exchange`` and ``crowding`` such that the model reproduces two runs on one host.

    The two numbers are found in turns until both runs come out: with one actor, too, there are moments in which all
    cores work. A run that is faster than its costs allow is not reproduced; what the model makes of both runs is kept
    beside what was measured.

    Args:
        costs: What an update costs, measured on a host of that many cores with one actor; ``switching`` stays as it is.
        cores: Cores of the host.
        one: Frames per second of the run with one actor.
        two: Of that with two.
    """
    found = replace(costs, exchange=0.0, crowding=0.0, measured_one=one, measured_two=two)
    for _ in range(_ROUNDS):
        before, found = found, _with_crowding(_with_exchange(found, cores), cores)
        found = replace(found, modelled_one=_speed(found, cores, 1), modelled_two=_speed(found, cores, 2))
        is_near = abs(found.modelled_one / one - 1.0) < NEAR and abs(found.modelled_two / two - 1.0) < NEAR
        if is_near or found == before:
            break
    return found


def _with_exchange(costs: Costs, cores: int) -> Costs:
    """Return costs whose ``exchange`` makes the run with one actor come out."""

    def excess(exchange: float) -> float:
        return 1.0 - costs.measured_one / _speed(replace(costs, exchange=exchange), cores, 1)

    most = costs.frames / costs.measured_one / (1 + costs.questions)  # a push and the questions of a fetch, all that is
    return replace(costs, exchange=_root(excess, most))


def _with_crowding(costs: Costs, cores: int) -> Costs:
    """Return costs whose ``crowding`` makes the run with two actors come out."""

    def excess(crowding: float) -> float:
        return 1.0 - costs.measured_two / _speed(replace(costs, crowding=crowding), cores, 2)

    return replace(costs, crowding=_root(excess, MOST_CROWDING))


def _speed(costs: Costs, cores: int, actors: int) -> float:
    return simulate(costs, Setting(actors=actors, one_host=True, cores=cores)).frames_per_second


def _root(excess: Callable[[float], float], most: float) -> float:
    """Return where a falling function is 0, from 0 to ``most``; the end that is nearest if it is nowhere.

    Times, not speeds, are compared: they grow nearly evenly with what is sought, which takes fewest steps.
    """
    if excess(0.0) <= 0.0:
        return 0.0
    if excess(most) >= 0.0:
        return most
    return float(brentq(excess, 0.0, most, xtol=_EXACT * most, rtol=_EXACT))
