"""Plans on a graph of zones: from the current zone over the sub-goal to the target zone [4.3]."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.graph.update import current_zone

EdgeCost = Literal["product", "normalized"]
"""``product``: the path of the largest product of edges, the paper's. ``normalized``: the released code's."""
EDGE_COSTS: Final[tuple[EdgeCost, ...]] = ("product", "normalized")
DEFAULT_EDGE_COST: Final[EdgeCost] = "normalized"
"""See docs/decisions/edge-cost.md."""
Subgoal = Literal["path", "target", "random"]
"""``path``: the second zone of the path, the paper's. ``target``: the target zone itself. ``random``: any zone, one for
each pair of current and target zone."""
_LEAST_EDGE: Final = 1e-12
"""Under ``normalized``, weaker edges count as this strong (released code)."""
_ROUNDING: Final = 1e-12
"""Costs whose difference is at most this share of 1 + cost are equal."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A path over zones, numbered from 0."""

    current: int
    """Zone that the agent is in."""
    target: int
    """Zone in which the target is seen most often."""
    subgoal: int
    """Second zone of the path; the target zone when the path has one edge or none."""
    path: tuple[int, ...]
    """From the current zone to the target zone; one zone when they are the same."""
    probability: float
    """Product of the edges on the path."""

    def as_dict(self) -> dict[str, Any]:
        """Return the fields for JSON: ``current, target, subgoal, path, probability``."""
        return asdict(self) | {"path": list(self.path)}


def plan_for(graph: SceneGraph, target: str, seen: Sequence[str], edge_cost: EdgeCost = DEFAULT_EDGE_COST) -> Plan:
    """Plan from what is seen to where a target is likely to be.

    Args:
        graph: Scene graph.
        target: Category to find.
        seen: Categories that are seen now, at least one.
        edge_cost: What makes a path short.

    Raises:
        UnknownNameError: The graph has no such category.
        InvalidValueError: Nothing is seen, so that every zone is as likely.
    """
    if not seen:
        message = "A plan starts from what is seen: name at least one category, for example 'Sink'."
        raise InvalidValueError(message)
    goal = int(target_zone(graph.nodes, graph.category(target)))
    here = int(current_zone(graph.nodes, graph.bag(seen)))
    return plan(graph.edges, here, goal, edge_cost)


def plan(edges: NDArray[np.float64], current: int, target: int, edge_cost: EdgeCost = DEFAULT_EDGE_COST) -> Plan:
    """Find the best path between two zones.

    Of equally good paths it is one with the fewest edges, and of these the one that comes first in the order of zone
    numbers. Zones that no path joins (zero edges under ``product``) are planned directly, with probability 0: the
    target zone is then all that can be aimed at.

    Args:
        edges: Zone edges, [K, K], in [0, 1]; ``edges[i, j]`` leads from i to j.
        current: Current zone.
        target: Target zone.
        edge_cost: What makes a path short.

    Raises:
        InvalidValueError: There is no such zone.
        UnknownNameError: There is no such edge cost.
    """
    for zone in (current, target):
        if not 0 <= zone < len(edges):
            message = f"There is no zone {zone}; zones are 0 to {len(edges) - 1}."
            raise InvalidValueError(message)
    following = next_hops(edges, edge_cost)
    path = [current]
    while path[-1] != target:
        path.append(int(following[path[-1], target]))
    return Plan(
        current=current,
        target=target,
        subgoal=path[1] if len(path) > 1 else target,
        path=tuple(path),
        probability=float(np.prod(edges[path[:-1], path[1:]])),
    )


def target_zone(nodes: NDArray[np.floating], category: int | NDArray[np.int64]) -> NDArray[np.int64]:
    """Find the zone where a category is seen most often, argmax_k delta_k[category] [4.3].

    Args:
        nodes: delta, zone nodes, [..., K, N].
        category: Index of the category, [...].

    Returns:
        Zone, int64 [...]; the first one of equals, so zone 0 for a category that no zone has.
    """
    index = np.asarray(category)[..., None, None]
    frequencies = np.take_along_axis(nodes, np.broadcast_to(index, (*nodes.shape[:-1], 1)), axis=-1)
    return np.asarray(frequencies[..., 0].argmax(axis=-1), dtype=np.int64)


def next_hops(edges: NDArray[np.float64], edge_cost: EdgeCost = DEFAULT_EDGE_COST) -> NDArray[np.int64]:
    """Find the sub-goal of every pair of current and target zone, the second zone of the path of `plan`.

    Args:
        edges: Zone edges, [K, K], in [0, 1].
        edge_cost: What makes a path short.

    Returns:
        ``hops[current, target]``, int64 [K, K]; the target zone itself when the path has one edge or none, or when
        no path joins the zones. O(K^3) memory and time a level of the paths.

    Raises:
        UnknownNameError: There is no such edge cost.
    """
    zones = len(edges)
    costs = edge_costs(edges, edge_cost)
    best = costs.copy()  # Floyd-Warshall: cost of the best path
    for via in range(zones):
        best = np.minimum(best, best[:, via, None] + best[None, via, :])

    # starts[i, n, j]: a best path from i to j may start with the edge from i to n.
    through = costs[:, :, None] + best[None, :, :]
    starts = np.isfinite(through) & (through <= (best + _ROUNDING * (1.0 + best))[:, None, :])
    starts[np.arange(zones), np.arange(zones)] = False

    # Fewest edges among the best paths, level by level from each target; `zones` means none.
    length = np.full((zones, zones), zones)
    np.fill_diagonal(length, 0)
    for level in range(1, zones):
        reached = (starts & (length == level - 1)[None]).any(axis=1)
        length[reached & (length == zones)] = level

    nearer = starts & (length[None, :, :] == length[:, None, :] - 1)
    # argmax: the first zone that will do, so the path that comes first in the order of zone numbers.
    return np.where(nearer.any(axis=1), nearer.argmax(axis=1), np.arange(zones))


def subgoals(edges: NDArray[np.float64], edge_cost: EdgeCost, subgoal: Subgoal) -> NDArray[np.int64]:
    """Find the zone that the policy is guided to from every current zone, for every target zone.

    Args:
        edges: Zone edges, [K, K], in [0, 1].
        edge_cost: What makes a path short.
        subgoal: Which zone of the path it is, or none of it. The random ones follow from K alone, so that all who
            plan on a graph agree.

    Returns:
        ``zones[current, target]``, int64 [K, K].

    Raises:
        UnknownNameError: There is no such edge cost.
    """
    zones = len(edges)
    match subgoal:
        case "path":
            return next_hops(edges, edge_cost)
        case "target":
            return np.tile(np.arange(zones), (zones, 1))
        case "random":
            return np.random.default_rng(zones).integers(zones, size=(zones, zones))


def edge_costs(edges: NDArray[np.float64], edge_cost: EdgeCost) -> NDArray[np.float64]:
    """Turn edges into costs whose least sum makes the best path.

    ``product``: -log e, infinite for a zero edge. ``normalized``: -log e with e clipped at 1e-12, min-max normalised
    to [0, 1] over the off-diagonal edges; when these are all equal, they cost 0 and the direct path wins as the one
    with the fewest edges.

    Args:
        edges: Zone edges, [K, K], in [0, 1].
        edge_cost: Which of the two.

    Returns:
        Costs, [K, K], not negative, 0 on the diagonal.

    Raises:
        UnknownNameError: There is no such edge cost.
    """
    if edge_cost not in EDGE_COSTS:
        raise UnknownNameError.of("edge-cost", edge_cost, EDGE_COSTS)
    if edge_cost == "product":
        with np.errstate(divide="ignore"):
            costs = -np.log(edges)
    else:
        costs = -np.log(np.maximum(edges, _LEAST_EDGE))
        others = costs[~np.eye(len(costs), dtype=np.bool_)]
        low, high = (others.min(), others.max()) if others.size else (0.0, 0.0)
        costs = (costs - low) / (high - low) if high - low > _ROUNDING else np.zeros_like(costs)
    np.fill_diagonal(costs, 0.0)
    return costs


def normalized_adjacency(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normalise edges symmetrically, E_hat = D^-1/2 E D^-1/2 with D the row sums [Eq. 5].

    No identity is added: the diagonal of E is 1 already.

    Args:
        edges: E, symmetric, [..., K, K].

    Returns:
        E_hat, [..., K, K].
    """
    scale = 1.0 / np.sqrt(edges.sum(axis=-1))
    return np.asarray(edges * scale[..., :, None] * scale[..., None, :])
