import numpy as np
import pytest

from hoz_dist.graph.merging import GraphSource, Merging
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import merge_rooms
from tests.unit.graph.samples import random_room_graph


@pytest.fixture
def rooms() -> list[RoomGraph]:
    rng = np.random.default_rng(0)
    return [random_room_graph(f"kitchen/{number}", rng) for number in range(1, 7)]


def test_by_default_rooms_are_merged_by_ascending_number(rooms: list[RoomGraph]) -> None:
    merged, expected = Merging().scene_graph("kitchen", rooms[::-1], 3), merge_rooms("kitchen", rooms, 3)
    np.testing.assert_array_equal(merged.nodes, expected.nodes)
    np.testing.assert_array_equal(merged.edges, expected.edges)
    assert (merged.rooms, merged.version) == (expected.rooms, 3)


def test_an_order_does_not_depend_on_who_came_first(rooms: list[RoomGraph]) -> None:
    one, other = (Merging(order=5).scene_graph("kitchen", some, 1) for some in (rooms, rooms[::-1]))
    np.testing.assert_array_equal(one.nodes, other.nodes)
    assert one.rooms == tuple(f"kitchen/{number}" for number in range(1, 7))


def test_orders_differ(rooms: list[RoomGraph]) -> None:
    graphs = [Merging(order=order).scene_graph("kitchen", rooms, 1).nodes.tobytes() for order in range(20)]
    assert len(set(graphs)) > 15


@pytest.mark.parametrize(
    ("source", "nodes", "edges"), [("random", True, True), ("random-nodes", True, False), ("random-edges", False, True)]
)
def test_random_graphs_hold_the_same_numbers_elsewhere(
    rooms: list[RoomGraph], source: GraphSource, nodes: bool, edges: bool
) -> None:
    true, spoilt = Merging().scene_graph("kitchen", rooms, 1), Merging(None, source, 7).scene_graph("kitchen", rooms, 1)
    assert (not np.array_equal(true.nodes, spoilt.nodes), not np.array_equal(true.edges, spoilt.edges)) == (
        nodes,
        edges,
    )
    np.testing.assert_array_equal(np.sort(true.nodes, axis=None), np.sort(spoilt.nodes, axis=None))
    np.testing.assert_array_equal(np.sort(true.edges, axis=None), np.sort(spoilt.edges, axis=None))
    np.testing.assert_array_equal(spoilt.edges, spoilt.edges.T)


def test_another_seed_is_another_random_graph(rooms: list[RoomGraph]) -> None:
    first, again, other = (Merging(None, "random", seed).scene_graph("kitchen", rooms, 1) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.nodes, again.nodes)
    assert not np.array_equal(first.nodes, other.nodes)
