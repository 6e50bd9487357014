"""The planner's oracle: every simple path between two zones."""

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray


def simple_paths(zones: int, current: int, target: int) -> Iterator[tuple[int, ...]]:
    """Yield all simple paths, those with fewer edges first, in the order of zone numbers."""
    if current == target:
        yield (current,)
        return
    others = [zone for zone in range(zones) if zone not in {current, target}]
    for length in range(len(others) + 1):
        for between in itertools.permutations(others, length):
            yield (current, *between, target)


def product_of(edges: NDArray[np.float64], path: tuple[int, ...]) -> float:
    """Multiply the edges on a path."""
    return math.prod(float(edges[a, b]) for a, b in itertools.pairwise(path))


def normalized_costs(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """-log(e), clipped at 1e-12, min-max normalised over the off-diagonal entries, written out by element."""
    zones = len(edges)
    logs = {(i, j): -math.log(max(float(edges[i, j]), 1e-12)) for i, j in itertools.permutations(range(zones), 2)}
    low, high = min(logs.values(), default=0.0), max(logs.values(), default=0.0)
    costs = np.zeros((zones, zones))
    for pair, cost in logs.items():
        costs[pair] = (cost - low) / (high - low) if high > low else 0.0
    return costs


def best_path(edges: NDArray[np.float64], current: int, target: int, edge_cost: str) -> tuple[int, ...]:
    """Return the first of the best paths."""
    paths = list(simple_paths(len(edges), current, target))
    if edge_cost == "product":
        values = [-product_of(edges, path) for path in paths]
    else:
        costs = normalized_costs(edges)
        values = [math.fsum(costs[a, b] for a, b in itertools.pairwise(path)) for path in paths]
    best = min(values)
    tolerance = 1e-12 * (abs(best) if edge_cost == "product" else 1.0)
    return next(path for path, value in zip(paths, values, strict=True) if value <= best + tolerance)
