import struct

import numpy as np
import pytest

from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.graph.update import current_zone
from hoz_dist.nav.categories import TARGETS
from hoz_dist.viz.zones import png, room_figure, scene_graph_figure, zone_colours
from tests.unit.graph.samples import open_floor, random_bags, random_scene_graph


def size_of(content: bytes) -> tuple[int, int]:
    assert content.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", content[16:24])
    return width, height


def test_picture_of_a_graph_names_zones_and_their_objects() -> None:
    graph = random_scene_graph()
    figure = scene_graph_figure(graph, top=1)
    texts = {text.get_text() for text in figure.axes[0].texts}
    assert {str(zone) for zone in range(8)} <= texts
    most = graph.nodes[0].argmax()
    assert f"{TARGETS[most]} {graph.nodes[0, most]:.2f}" in texts
    assert min(size_of(png(figure))) >= 800


@pytest.mark.parametrize("zones", [1, 2, 30])
def test_any_number_of_zones_can_be_drawn(zones: int) -> None:
    assert png(scene_graph_figure(random_scene_graph(zones=zones)))
    assert len(set(zone_colours(zones))) == zones


def test_zones_without_objects_and_equal_edges_can_be_drawn() -> None:
    graph = SceneGraph("bathroom", 0, (), TARGETS, np.zeros((3, 22)), np.ones((3, 3)))
    figure = scene_graph_figure(graph)
    assert "nothing seen" in {text.get_text() for text in figure.axes[0].texts}
    assert png(figure)


def test_picture_of_a_room_has_the_colour_of_the_zone_where_the_view_looks() -> None:
    graph = random_scene_graph()
    room = open_floor(3, 2)
    labels = current_zone(graph.nodes, random_bags(room.views, np.random.default_rng(0)))
    figure = room_figure(graph, "kitchen/3", room.positions, labels)
    above = figure.axes[1]
    (sectors,) = above.collections[:1]
    colours = np.asarray(sectors.get_facecolor())
    assert len(sectors.get_paths()) == room.views
    np.testing.assert_allclose(colours, np.array(zone_colours(8))[labels])
    # View 4 is of yaw 90: it looks along +x from position 0.
    x, z = room.positions[0] * 0.25
    centre = np.mean(np.asarray(sectors.get_paths()[4].vertices), axis=0)
    assert centre[0] > x
    assert centre[1] == pytest.approx(z, abs=0.02)
    assert png(figure)
