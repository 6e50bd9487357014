import itertools

import numpy as np
import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.room_graph import RoomGraph, build_room_graph, explore_room, zone_edges, zone_nodes
from hoz_dist.graph.views import Views
from tests.unit.graph.samples import open_floor, random_bags


def test_nodes_are_the_mean_of_the_bags_of_a_zone() -> None:
    bags = np.array([[1, 0], [1, 1], [0, 0], [0, 1]], dtype=np.bool_)
    nodes = zone_nodes(bags, np.array([0, 0, 0, 1]), 2)
    np.testing.assert_allclose(nodes, np.array([[2 / 3, 1 / 3], [0, 1]]))


@pytest.mark.parametrize(("reach", "steps"), [(0.25, 1), (0.5, 2)])
def test_edges_agree_with_a_loop_over_all_pairs(reach: float, steps: int) -> None:
    rng = np.random.default_rng(0)
    positions = rng.integers(-3, 4, (60, 2)).astype(np.int16)
    labels = np.concatenate([np.arange(4), rng.integers(0, 4, 56)])
    expected = np.eye(4)
    for first, second in itertools.permutations(range(4), 2):
        pairs = list(itertools.product(positions[labels == first], positions[labels == second]))
        expected[first, second] = np.mean([abs(a - b).sum() <= steps for a, b in pairs])
    np.testing.assert_allclose(zone_edges(positions, labels, 4, reach), expected)


def test_edges_by_hand() -> None:
    # Two views of zone 0 at (0, 0); of zone 1 one is 0.25 m away, the diagonal neighbour is 0.5 m away.
    positions = np.array([[0, 0], [0, 0], [0, 1], [1, 1]], dtype=np.int16)
    np.testing.assert_allclose(zone_edges(positions, np.array([0, 0, 1, 1]), 2), [[1, 0.5], [0.5, 1]])


def test_exploring_a_room_twice_gives_the_same_graph() -> None:
    room = open_floor(8, 6)
    bags = random_bags(room.views, np.random.default_rng(0))
    first, second = (
        explore_room("kitchen/3", "d", transitions=room.transitions, positions=room.positions, bags=bags)
        for _ in range(2)
    )
    np.testing.assert_array_equal(first.nodes, second.nodes)
    np.testing.assert_array_equal(first.edges, second.edges)
    assert first.nodes.shape == (8, 22)
    assert first.edges.shape == (8, 8)


@pytest.mark.parametrize("distinct", [1, 2, 5])
def test_room_with_fewer_distinct_bags_than_zones_has_a_sound_graph(distinct: int) -> None:
    room = open_floor(4, 3)
    rng = np.random.default_rng(distinct)
    bags = random_bags(distinct, rng)[rng.integers(distinct, size=room.views)]
    graph = explore_room("bathroom/1", "d", transitions=room.transitions, positions=room.positions, bags=bags)
    assert np.isfinite(graph.nodes).all()
    np.testing.assert_array_equal(graph.edges, graph.edges.T)
    np.testing.assert_array_equal(np.diagonal(graph.edges), 1)


def test_nodes_weighed_by_views_average_to_all_views() -> None:
    rng = np.random.default_rng(0)
    views = Views(random_bags(200, rng), rng.integers(0, 9, (200, 2)).astype(np.int16))
    graph = build_room_graph("kitchen/1", "d", views, zones=1)
    np.testing.assert_allclose(graph.nodes[0], views.bags.mean(axis=0))


@pytest.mark.parametrize(
    ("nodes", "edges", "complaint"),
    [
        (np.full((2, 3), np.nan), np.eye(2), "Nodes must be finite"),
        (np.full((2, 3), 1.1), np.eye(2), "Nodes must be finite numbers from 0 to 1"),
        (np.zeros((2, 3)), np.eye(2) - 0.1, "Edges must be finite numbers from 0 to 1"),
        (np.zeros((2, 3)), np.full((2, 2), 0.5), "1 on the diagonal"),
        (np.zeros((3, 3)), np.eye(2), "Nodes must be a table of 2 zones"),
        (np.zeros((2, 3)), np.ones((2, 3)), "Edges must be a square table"),
        (np.zeros((2, 0)), np.eye(2), "categories"),
        (np.zeros(()), np.zeros(()), "Edges must be"),
    ],
)
def test_arrays_that_are_no_zone_graph_are_refused(nodes: np.ndarray, edges: np.ndarray, complaint: str) -> None:
    with pytest.raises(InvalidValueError, match=complaint):
        RoomGraph("kitchen/1", "d", nodes, edges)
