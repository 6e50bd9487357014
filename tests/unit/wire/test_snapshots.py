import pytest

from hoz_dist.errors import InvalidValueError, NotFoundError, UnknownNameError
from hoz_dist.graph.planner import plan_for
from hoz_dist.wire.protocol.codec import decode
from hoz_dist.wire.protocol.graph_messages import RoomGraphReply, SceneGraphReply
from hoz_dist.wire.protocol.graphs import plan_of
from hoz_dist.wire.serving.snapshots import Snapshots
from tests import wire_samples as samples


@pytest.fixture
def snapshots() -> Snapshots:
    snapshots = Snapshots(samples.config_reply(), samples.status_reply, "product")
    snapshots.put("kitchen", samples.scene_graph())
    snapshots.put("kitchen/3", samples.room_graph())
    return snapshots


def test_a_plan_is_the_planners(snapshots: Snapshots) -> None:
    reply = snapshots.plan("kitchen", {"target": "Microwave", "seen": "Sink+Toaster"})
    assert plan_of(reply) == plan_for(samples.scene_graph(), "Microwave", ["Sink", "Toaster"], "product")


def test_graphs_are_found_by_scene_and_by_room(snapshots: Snapshots) -> None:
    scene = decode(snapshots.graph("kitchen").payload, SceneGraphReply)
    assert (scene.scene, scene.version) == ("kitchen", 2)
    assert str(decode(snapshots.graph("kitchen/3").payload, RoomGraphReply).room) == "kitchen/3"


def test_what_is_served_is_the_newest(snapshots: Snapshots) -> None:
    snapshots.put("kitchen", samples.scene_graph(version=3))
    assert decode(snapshots.graph("kitchen").payload, SceneGraphReply).version == 3


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        (
            "bathroom",
            "There is no graph of 'bathroom' yet: no actor of this run has explored a room of scene bathroom.",
        ),
        ("kitchen/4", "There is no graph of 'kitchen/4' yet: no actor of this run has explored room kitchen/4."),
    ],
)
def test_what_was_not_explored_yet_is_said(snapshots: Snapshots, name: str, sentence: str) -> None:
    with pytest.raises(NotFoundError) as caught:
        snapshots.graph(name)
    assert str(caught.value) == sentence


def test_unknown_names_are_said(snapshots: Snapshots) -> None:
    with pytest.raises(UnknownNameError, match=r"Unknown scene 'kichen'\. Did you mean 'kitchen'"):
        snapshots.graph("kichen")
    with pytest.raises(UnknownNameError, match="Unknown room 'kitchen/77'"):
        snapshots.graph("kitchen/77")
    with pytest.raises(UnknownNameError, match="Unknown scene 'garage'"):
        snapshots.plan("garage", {"target": "Pan", "seen": "Sink"})
    with pytest.raises(UnknownNameError, match="Unknown category 'Sofa'"):
        snapshots.plan("kitchen", {"target": "Sofa", "seen": "Sink"})
    with pytest.raises(UnknownNameError, match="Unknown category 'Sofa'"):
        snapshots.plan("kitchen", {"target": "Pan", "seen": "Sink+Sofa"})


def test_a_plan_needs_a_target_and_something_seen(snapshots: Snapshots) -> None:
    with pytest.raises(InvalidValueError, match="needs a target"):
        snapshots.plan("kitchen", {"seen": "Sink"})
    for seen in ({}, {"seen": ""}, {"seen": "++"}):
        with pytest.raises(InvalidValueError, match="name at least one category"):
            snapshots.plan("kitchen", {"target": "Pan"} | seen)
