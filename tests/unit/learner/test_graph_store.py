import logging

import numpy as np
import pytest

from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import merge_rooms
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from learner.graph_store import GraphStore
from tests.unit.learner.making import ZONES, room_graph


def test_a_scene_graph_is_the_merge_of_its_rooms_whoever_came_first() -> None:
    rooms = [room_graph(f"kitchen/{number}", number) for number in (3, 1, 2)]
    store = GraphStore(ZONES, {})
    assert all(store.add(room) for room in rooms)
    expected = merge_rooms("kitchen", sorted(rooms, key=lambda room: room.room), version=3)
    np.testing.assert_array_equal(store.scenes["kitchen"].nodes, expected.nodes)
    np.testing.assert_array_equal(store.scenes["kitchen"].edges, expected.edges)
    assert store.scenes["kitchen"].rooms == ("kitchen/1", "kitchen/2", "kitchen/3")
    assert store.scenes["kitchen"].version == 3


def test_scenes_change_apart() -> None:
    store = GraphStore(ZONES, {})
    store.add(room_graph("kitchen/1"))
    store.add(room_graph("bathroom/1"))
    assert store.versions == {"kitchen": 1, "bathroom": 1}


def test_a_known_graph_changes_nothing() -> None:
    store = GraphStore(ZONES, {})
    store.add(room_graph("kitchen/1"))
    other = room_graph("kitchen/1")
    slightly = RoomGraph("kitchen/1", other.digest, other.nodes, np.clip(other.edges - 1e-9, 0, 1))
    assert not store.add(room_graph("kitchen/1"))
    assert not store.add(slightly)
    assert store.versions == {"kitchen": 1}


def test_another_graph_of_the_same_room_is_taken_without_a_change_and_said_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    store = GraphStore(ZONES, {})
    first = room_graph("kitchen/1")
    store.add(first)
    with caplog.at_level(logging.INFO):
        for seed in (5, 6):
            assert not store.add(room_graph("kitchen/1", seed=seed))
    assert [record.levelname for record in caplog.records] == ["INFO"]
    np.testing.assert_array_equal(store.rooms["kitchen/1"].nodes, first.nodes)
    assert store.versions == {"kitchen": 1}


def test_saved_graphs_of_rooms_that_changed_are_dropped(caplog: pytest.LogCaptureFixture) -> None:
    saved = [room_graph("kitchen/1"), room_graph("kitchen/2"), room_graph("bathroom/1")]
    digests = {"kitchen/1": "new", "kitchen/2": "d0", "bathroom/1": "new"}
    store = GraphStore(ZONES, digests, saved, {"kitchen": 2, "bathroom": 1})
    assert list(store.rooms) == ["kitchen/2"]
    assert store.scenes.keys() == {"kitchen"}
    assert store.scenes["kitchen"].version == 3
    assert "dropped the saved graph of kitchen/1" in caplog.text
    assert store.add(room_graph("kitchen/1", digest="new"))
    assert store.add(room_graph("bathroom/1", digest="new"))
    assert store.versions == {"kitchen": 4, "bathroom": 3}


@pytest.mark.parametrize(
    ("graph", "reason"),
    [
        (room_graph("kitchen/1", digest="another"), Reason.DIGEST),
        (room_graph("kitchen/2", digest="another"), Reason.DIGEST),
        (room_graph("kitchen/25"), Reason.SPLIT),
        (room_graph("kitchen/30"), Reason.SPLIT),
        (room_graph("kitchen/3", zones=ZONES + 1), Reason.SHAPE),
    ],
    ids=["other content", "not of the catalogue", "validation", "test", "zones"],
)
def test_a_graph_that_cannot_be_taken_leaves_the_store_as_it_was(graph: RoomGraph, reason: Reason) -> None:
    store = GraphStore(ZONES, {"kitchen/2": "d0"})
    first = room_graph("kitchen/1")
    store.add(first)
    with pytest.raises(RejectedError) as refusal:
        store.add(graph)
    assert refusal.value.reason == reason
    assert list(store.rooms) == ["kitchen/1"]
    np.testing.assert_array_equal(store.scenes["kitchen"].nodes, first.nodes)


def test_a_store_goes_on_where_another_stopped() -> None:
    store = GraphStore(ZONES, {})
    for number in (1, 2):
        store.add(room_graph(f"kitchen/{number}", number))
    again = GraphStore(ZONES, {}, store.rooms.values(), store.versions)
    np.testing.assert_array_equal(again.scenes["kitchen"].nodes, store.scenes["kitchen"].nodes)
    again.add(room_graph("kitchen/3", 3))
    assert again.versions == {"kitchen": 3}
