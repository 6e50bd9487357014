import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.graph.planner import (
    EDGE_COSTS,
    EdgeCost,
    Plan,
    next_hops,
    normalized_adjacency,
    plan,
    plan_for,
    subgoals,
    target_zone,
)
from tests.unit.graph.exhaustive import best_path, product_of
from tests.unit.graph.samples import random_edges, random_scene_graph

edge_costs = pytest.mark.parametrize("edge_cost", EDGE_COSTS)


@edge_costs
@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), zones=st.integers(1, 6), coarse=st.booleans())
def test_plans_agree_with_an_exhaustive_search(edge_cost: EdgeCost, seed: int, zones: int, *, coarse: bool) -> None:
    rng = np.random.default_rng(seed)
    edges = random_edges(zones, rng)
    if coarse:  # many ties, and edges of 0 and 1
        edges = np.maximum(rng.choice([0.0, 0.25, 0.5, 1.0], (zones, zones)), np.eye(zones))
    for current, target in itertools.product(range(zones), repeat=2):
        found = plan(edges, current, target, edge_cost)
        assert found.path == best_path(edges, current, target, edge_cost)
        assert found.probability == pytest.approx(product_of(edges, found.path), abs=0)


@edge_costs
def test_table_of_next_hops_agrees_with_the_plans(edge_cost: EdgeCost) -> None:
    edges = random_edges(12, np.random.default_rng(0))
    hops = next_hops(edges, edge_cost)
    assert hops.dtype == np.int64
    for current, target in itertools.product(range(12), repeat=2):
        assert hops[current, target] == plan(edges, current, target, edge_cost).subgoal


@edge_costs
def test_current_zone_is_the_target_zone(edge_cost: EdgeCost) -> None:
    edges = random_edges(4, np.random.default_rng(0))
    assert plan(edges, 2, 2, edge_cost) == Plan(current=2, target=2, subgoal=2, path=(2,), probability=1.0)


@edge_costs
def test_one_zone_alone_can_be_planned_on(edge_cost: EdgeCost) -> None:
    assert plan(np.eye(1), 0, 0, edge_cost).path == (0,)


@edge_costs
@pytest.mark.parametrize("edge", [0.0, 1e-300, 0.07, 1.0])
def test_equal_edges_make_direct_paths(edge_cost: EdgeCost, edge: float) -> None:
    edges = np.maximum(np.eye(8), edge)
    for current, target in itertools.permutations(range(8), 2):
        assert plan(edges, current, target, edge_cost).path == (current, target)


@edge_costs
def test_edges_equal_but_for_rounding_make_direct_paths(edge_cost: EdgeCost) -> None:
    noise = np.random.default_rng(0).uniform(-1e-16, 1e-16, (8, 8))
    edges = np.where(np.eye(8, dtype=np.bool_), 1.0, 0.07 + noise)
    assert plan(edges, 0, 5, edge_cost).path == (0, 5)


@edge_costs
def test_a_strong_detour_beats_a_weak_edge(edge_cost: EdgeCost) -> None:
    edges = np.array([[1, 0.9, 0.1], [0.9, 1, 0.9], [0.1, 0.9, 1]])
    assert plan(edges, 0, 2, edge_cost) == Plan(0, 2, subgoal=1, path=(0, 1, 2), probability=0.9 * 0.9)


def test_zones_that_no_path_joins_are_planned_directly_with_probability_zero() -> None:
    edges = np.array([[1, 0.5, 0], [0.5, 1, 0], [0, 0, 1]])
    assert plan(edges, 0, 2, "product") == Plan(0, 2, subgoal=2, path=(0, 2), probability=0.0)
    assert plan(edges, 0, 1, "product").path == (0, 1)


def test_of_equal_paths_the_one_with_fewest_edges_and_smallest_zones_is_taken() -> None:
    edges = np.full((5, 5), 0.25)
    np.fill_diagonal(edges, 1.0)
    edges[0, 3] = edges[3, 4] = 0.5  # 0 > 3 > 4 has the product of the direct edge
    assert plan(edges, 0, 4, "product").path == (0, 4)
    edges[0, 4] = 0.0
    edges[0, 2] = edges[2, 4] = 0.5  # as good as by way of 3
    assert plan(edges, 0, 4, "product").path == (0, 2, 4)


def test_edges_are_not_changed() -> None:
    edges = random_edges(5, np.random.default_rng(0))
    before = edges.copy()
    for edge_cost in EDGE_COSTS:
        next_hops(edges, edge_cost)
    np.testing.assert_array_equal(edges, before)


def test_zone_or_edge_cost_that_does_not_exist_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="no zone 8; zones are 0 to 7"):
        plan(np.eye(8), 0, 8)
    with pytest.raises(UnknownNameError, match="Did you mean 'product'"):
        plan(np.eye(8), 0, 1, "prod")  # type: ignore[arg-type]


def test_target_zone_is_where_the_target_is_seen_most() -> None:
    nodes = np.zeros((3, 22))
    nodes[:, 13] = 0.2, 0.6, 0.6
    assert target_zone(nodes, 13) == 1
    assert target_zone(nodes, 0) == 0
    batch = np.stack([nodes, nodes[::-1]])
    np.testing.assert_array_equal(target_zone(batch, np.array([13, 13])), [1, 0])


def test_plan_starts_where_the_seen_objects_are_and_ends_where_the_target_is() -> None:
    graph = random_scene_graph()
    found = plan_for(graph, "Microwave", ["Sink", "Toaster"])
    assert found.target == graph.nodes[:, graph.category("Microwave")].argmax()
    assert found.path[0] == found.current
    assert found.path[-1] == found.target
    assert list(found.as_dict()) == ["current", "target", "subgoal", "path", "probability"]


def test_plan_needs_something_seen_and_known_names() -> None:
    graph = random_scene_graph()
    with pytest.raises(InvalidValueError, match="name at least one category"):
        plan_for(graph, "Microwave", [])
    with pytest.raises(UnknownNameError, match="Unknown category 'Unicorn'"):
        plan_for(graph, "Unicorn", ["Sink"])
    with pytest.raises(UnknownNameError, match="Unknown category 'Unicorn'"):
        plan_for(graph, "Sink", ["Unicorn"])


def test_normalized_adjacency_is_the_matrix_product() -> None:
    edges = random_edges(8, np.random.default_rng(0))
    scale = np.diag(edges.sum(axis=1) ** -0.5)
    expected = scale @ edges @ scale
    np.testing.assert_allclose(normalized_adjacency(edges), expected)
    np.testing.assert_allclose(normalized_adjacency(np.stack([edges, np.eye(8)])), np.stack([expected, np.eye(8)]))
    assert np.abs(np.linalg.eigvalsh(expected)).max() == pytest.approx(1.0)


def test_the_subgoal_is_on_the_path_or_the_target_zone_or_any() -> None:
    edges = random_edges(6, np.random.default_rng(4))
    np.testing.assert_array_equal(subgoals(edges, "normalized", "path"), next_hops(edges, "normalized"))
    np.testing.assert_array_equal(subgoals(edges, "normalized", "target")[2], np.arange(6))
    drawn = subgoals(edges, "normalized", "random")
    np.testing.assert_array_equal(drawn, subgoals(random_edges(6, np.random.default_rng(5)), "product", "random"))
    assert set(drawn.ravel().tolist()) == set(range(6))
