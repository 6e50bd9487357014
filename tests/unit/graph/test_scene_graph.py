import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.graph.matching import match
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph, merge_rooms, top_objects
from hoz_dist.nav.categories import TARGETS
from tests.unit.graph.samples import random_room_graph, random_scene_graph

seeds = st.integers(0, 2**32 - 1)


def renamed(graph: RoomGraph, room: str) -> RoomGraph:
    return dataclasses.replace(graph, room=room)


def reordered(graph: RoomGraph, order: np.ndarray) -> RoomGraph:
    return dataclasses.replace(graph, nodes=graph.nodes[order], edges=graph.edges[np.ix_(order, order)])


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(1, 6))
def test_merge_of_identical_rooms_is_the_room(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    room = random_room_graph("kitchen/1", rng)
    copies = [reordered(renamed(room, f"kitchen/{number}"), rng.permutation(8)) for number in range(2, count + 1)]
    merged = merge_rooms("kitchen", [room, *copies], 1)
    np.testing.assert_allclose(merged.nodes, room.nodes, atol=1e-12)
    np.testing.assert_allclose(merged.edges, room.edges, atol=1e-12)


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_order_of_arrival_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rooms = [random_room_graph(f"kitchen/{number}", rng) for number in (2, 10, 1, 20)]
    merged = merge_rooms("kitchen", rooms, 1)
    shuffled = merge_rooms("kitchen", [rooms[index] for index in rng.permutation(4)], 1)
    assert merged.rooms == ("kitchen/1", "kitchen/2", "kitchen/10", "kitchen/20")
    np.testing.assert_array_equal(merged.nodes, shuffled.nodes)
    np.testing.assert_array_equal(merged.edges, shuffled.edges)


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(1, 8), st.integers(1, 12))
def test_every_room_weighs_the_same(seed: int, count: int, zones: int) -> None:
    rng = np.random.default_rng(seed)
    rooms = [random_room_graph(f"kitchen/{number}", rng, zones) for number in range(1, count + 1)]
    merged = merge_rooms("kitchen", rooms, 1)
    # However zones are matched, sums over all zones are averages over the rooms.
    np.testing.assert_allclose(merged.nodes.sum(axis=0), np.mean([room.nodes.sum(axis=0) for room in rooms], axis=0))
    np.testing.assert_allclose(merged.edges.sum(), np.mean([room.edges.sum() for room in rooms]))
    assert np.isfinite(merged.nodes).all()
    np.testing.assert_allclose(merged.edges, merged.edges.T)


def test_merge_is_a_running_mean_over_matched_zones() -> None:
    rng = np.random.default_rng(4)
    rooms = [random_room_graph(f"bedroom/{number}", rng) for number in (1, 2, 3)]
    nodes = rooms[0].nodes
    for weight, room in ((1 / 2, rooms[1]), (1 / 3, rooms[2])):
        nodes = (1 - weight) * nodes + weight * room.nodes[match(nodes, room.nodes)]
    np.testing.assert_allclose(merge_rooms("bedroom", rooms, 1).nodes, nodes)


@settings(max_examples=20, deadline=None)
@given(seeds, st.sampled_from([0.0, 1.0]))
def test_merge_of_extreme_rooms_stays_in_range(seed: int, value: float) -> None:
    rng = np.random.default_rng(seed)
    rooms = [
        RoomGraph(f"bathroom/{number}", "d", np.full((8, 22), value), np.maximum(np.eye(8), value))
        for number in range(1, 1 + int(rng.integers(1, 21)))
    ]
    merged = merge_rooms("bathroom", rooms, 1)
    np.testing.assert_array_equal(merged.nodes, value)


def test_rooms_are_not_changed_by_a_merge() -> None:
    rng = np.random.default_rng(0)
    rooms = [random_room_graph(f"kitchen/{number}", rng) for number in (1, 2)]
    before = rooms[0].nodes.copy()
    merge_rooms("kitchen", rooms, 1)
    np.testing.assert_array_equal(rooms[0].nodes, before)


def test_what_cannot_be_merged_is_refused() -> None:
    rng = np.random.default_rng(0)
    kitchen, again = (random_room_graph("kitchen/1", rng) for _ in range(2))
    with pytest.raises(InvalidValueError, match="no graph of a room of 'kitchen'"):
        merge_rooms("kitchen", [], 1)
    with pytest.raises(InvalidValueError, match="bedroom/1 cannot be merged into the graph of scene 'kitchen'"):
        merge_rooms("kitchen", [kitchen, random_room_graph("bedroom/1", rng)], 1)
    with pytest.raises(InvalidValueError, match="kitchen/1 cannot be merged twice"):
        merge_rooms("kitchen", [kitchen, again], 1)
    with pytest.raises(InvalidValueError, match="different numbers of zones"):
        merge_rooms("kitchen", [kitchen, random_room_graph("kitchen/2", rng, zones=4)], 1)


def test_categories_are_found_by_name() -> None:
    graph = random_scene_graph()
    assert graph.category("microwave") == TARGETS.index("Microwave")
    with pytest.raises(UnknownNameError, match="Did you mean 'Microwave'"):
        graph.category("Microwav")
    assert np.flatnonzero(graph.bag(["Sink", "toaster"])).tolist() == [18, 21]


def test_top_objects_are_ordered_and_leave_out_what_is_never_seen() -> None:
    nodes = np.zeros((1, 22))
    nodes[0, [3, 5]] = 0.2, 0.7
    graph = SceneGraph("kitchen", 0, (), TARGETS, nodes, np.eye(1))
    assert top_objects(graph, 0, 5) == [("CoffeeMachine", 0.7), ("CellPhone", 0.2)]
    assert top_objects(graph, 0, 1) == [("CoffeeMachine", 0.7)]


def test_version_and_categories_are_checked() -> None:
    nodes, edges = np.zeros((1, 2)), np.eye(1)
    with pytest.raises(InvalidValueError, match="version"):
        SceneGraph("kitchen", -1, (), ("a", "b"), nodes, edges)
    with pytest.raises(InvalidValueError, match="Categories must differ"):
        SceneGraph("kitchen", 0, (), ("a", "A"), nodes, edges)
