"""Fits what cannot be measured by itself, so that the model does what runs of one and two actors did."""

from dataclasses import replace
from typing import Final

from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.model import simulate
from hoz_dist.scaling.setting import Setting

MOST_CROWDING: Final = 4.0
_HALVINGS: Final = 12


def fitted(costs: Costs, cores: int, one: float, two: float) -> Costs:
    """Return costs with ``exchange`` and ``crowding`` such that the model reproduces two runs on one host.

    Args:
        costs: What an update costs, measured on a host of that many cores with one actor.
        cores: Cores of the host.
        one: Frames per second of the run with one actor.
        two: Of that with two.
    """
    plain = replace(costs, exchange=0.0, crowding=0.0)
    # With one actor everything happens one after the other, so what is missing is what messages take.
    missing = costs.frames / one - costs.frames / _speed(plain, cores, 1)
    plain = replace(plain, exchange=max(missing, 0.0) / (1 + costs.round_trips))
    low, high = 0.0, MOST_CROWDING
    if _speed(plain, cores, 2) <= two:
        return plain
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if _speed(replace(plain, crowding=middle), cores, 2) > two else (low, middle)
    return replace(plain, crowding=(low + high) / 2)


def _speed(costs: Costs, cores: int, actors: int) -> float:
    return simulate(costs, Setting(actors=actors, one_host=True, cores=cores)).frames_per_second
