"""PyBullet's side of a room: collision queries, pictures, and the rules by which rooms are accepted."""

import dataclasses
import statistics

import numpy as np
import pytest

from hoz_dist.nav.categories import SCENES
from hoz_dist.nav.pose import GRID_M, Pose
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.bullet import pybullet
from hoz_dist.sim.camera import FAR_M, Camera
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.pose_graph import build_pose_graph
from hoz_dist.sim.room import Item, Part, Room, Vector
from hoz_dist.sim.validation import POSITIONS, find_fault
from hoz_dist.sim.world import World

pytestmark = pytest.mark.integration

RED: Vector = (0.9, 0.1, 0.1)
GREEN: Vector = (0.1, 0.9, 0.1)


def block(category: str, size: Vector, centre: Vector, colour: Vector = RED) -> Item:
    return Item(category, (Part("box", size, centre, colour),))


def bare_room(*items: Item) -> Room:
    """A floor of 4 m x 4 m without walls."""
    floor = block("Walls", (4.0, 4.0, 0.1), (2.0, 2.0, -0.05), (0.5, 0.5, 0.5))
    return Room(RoomId("kitchen", 1), 4.0, 4.0, (floor, *items))


def test_the_agent_keeps_its_radius_from_what_stands_there() -> None:
    table = block("Table", (1.0, 1.0, 0.7), (2.0, 2.0, 0.35))
    with World(bare_room(table)) as world:
        assert not world.is_free(2.0, 2.0)
        assert not world.is_free(2.0, 1.31)
        assert world.is_free(2.0, 1.29)
        # A cylinder reaches a corner later than a square would.
        assert world.is_free(1.35, 1.35)
        assert not world.is_free(1.37, 1.37)


def test_rugs_and_what_hangs_overhead_do_not_stop_the_agent() -> None:
    rug = block("Rug", (2.0, 2.0, 0.02), (2.0, 2.0, 0.01))
    cupboard = block("Cabinet", (1.0, 1.0, 0.5), (2.0, 2.0, 1.9))
    table_top = block("Table", (1.0, 1.0, 0.05), (2.0, 2.0, 0.75))
    with World(bare_room(rug, cupboard)) as world:
        assert world.is_free(2.0, 2.0)
        world.load(bare_room(table_top))
        assert not world.is_free(2.0, 2.0)


def test_a_thin_screen_between_two_free_positions_blocks_the_way() -> None:
    screen = block("Screen", (0.02, 0.02, 1.0), (2.0, 2.0, 0.5))
    with World(bare_room(screen)) as world:
        assert world.is_free(1.75, 2.0)
        assert world.is_free(2.25, 2.0)
        assert not world.can_move(1.75, 2.0, 2.25, 2.0)
        assert not world.can_move(2.25, 2.0, 1.75, 2.0)
        assert world.can_move(1.75, 2.0, 1.75, 2.25)
        # Diagonally past the screen, then across it: only the way itself tells the two apart.
        assert world.can_move(1.75, 2.0, 1.5, 2.25)
        assert not world.can_move(1.8, 1.8, 2.2, 2.2)
        assert not world.can_move(1.8, 2.2, 2.2, 1.8)


def test_outside_the_room_is_not_free() -> None:
    with World(bare_room()) as world:
        assert not world.is_free(-0.25, 2.0)
        assert not world.is_free(2.0, 4.25)


def test_pictures_look_where_the_pose_looks() -> None:
    ahead = block("Fridge", (0.5, 0.5, 2.0), (2.0, 3.75, 1.0), RED)
    right = block("Sofa", (0.5, 0.5, 2.0), (3.75, 2.0, 1.0), GREEN)
    with World(bare_room(ahead, right)) as world:
        camera = Camera(world, 65)
        forward, sideways = camera.render(Pose(2.0, 2.0, 0, 0)), camera.render(Pose(2.0, 2.0, 90, 0))
        between = camera.render(Pose(2.0, 2.0, 45, 0))
    centre = (32, 32)
    assert forward.segmentation[centre] == 2
    assert forward.rgb[centre].argmax() == 0
    assert sideways.segmentation[centre] == 3
    assert sideways.rgb[centre].argmax() == 1
    columns = [np.flatnonzero((between.segmentation == label).any(axis=0)).mean() for label in (2, 3)]
    assert columns[0] < 32 < columns[1], "what is at the right is drawn at the right"


def test_a_corner_in_the_cameras_own_plane_does_not_stop_the_renderer() -> None:
    """PyBullet never came back from this picture."""
    with World(load_room(RoomId("bedroom", 26))) as world:
        depth = Camera(world, 64).render(Pose(0.25, 3.0, 90, 0)).depth
    assert np.isfinite(depth).all()


def test_depth_is_in_metres_along_the_viewing_axis() -> None:
    wall = block("Wall", (4.0, 0.1, 3.0), (2.0, 3.55, 1.5))
    with World(bare_room(wall)) as world:
        level = Camera(world, 65).render(Pose(2.0, 2.0, 0, 0))
        down = Camera(world, 65).render(Pose(2.0, 1.0, 0, 30))
    on_wall = level.segmentation == 2
    # Every point of the wall is equally far along the axis, also at the picture's edge.
    np.testing.assert_allclose(level.depth[on_wall], 1.5, atol=2e-3)
    # Looking 30 degrees down from 1.58 m, the axis meets the wall (2.5 m ahead) before the floor;
    # the allowance is half a pixel.
    assert down.depth[32, 32] == pytest.approx(2.5 / np.cos(np.pi / 6), abs=0.03)
    assert down.segmentation[-1, 32] == 1


def test_nothing_is_labelled_zero_and_far_away() -> None:
    with World(bare_room()) as world:
        frame = Camera(world, 32).render(Pose(2.0, 2.0, 0, 0))
    assert frame.segmentation[0].max() == 0
    assert frame.depth[0].min() == pytest.approx(FAR_M, rel=1e-3)
    assert frame.rgb.dtype == frame.segmentation.dtype == np.uint8
    assert frame.depth.dtype == np.float32


def test_collision_queries_leave_no_trace_in_pictures() -> None:
    with World(load_room(RoomId("bathroom", 1))) as world:
        graph = build_pose_graph(world)
        pose = graph.pose(0)
        before = Camera(world).render(pose)
        build_pose_graph(world)
        after = Camera(world).render(pose)
        labels = set(np.unique(after.segmentation))
        items = len(world.room.items)
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one, other)
    assert labels <= set(range(1, items + 1))


def test_loading_replaces_the_room_and_closing_ends_the_client() -> None:
    first, second = load_room(RoomId("bathroom", 1)), load_room(RoomId("kitchen", 1))
    with World(first) as world, World(second) as fresh:
        client = world.client
        world.load(second)
        assert world.room is second
        assert sorted(world.body_items.values()) == list(range(len(second.items)))
        pose = build_pose_graph(fresh).pose(7)
        for one, other in zip(Camera(world).render(pose), Camera(fresh).render(pose), strict=True):
            np.testing.assert_array_equal(one, other)
    assert not pybullet.isConnected(client)


def test_an_item_that_pybullet_cannot_take_is_refused() -> None:
    part = Part("box", (0.1, 0.1, 0.1), (1.0, 1.0, 0.05), RED)
    with World() as world, pytest.raises(ValueError, match="Shelf has 17 parts"):
        world.load(bare_room(Item("Shelf", (part,) * 17)))


@pytest.mark.parametrize("scene", SCENES)
def test_rooms_are_as_large_as_the_field_says(scene: str) -> None:
    counts = []
    with World() as world:
        for number in range(1, 76, 5) if scene == "apartment" else range(1, 31):
            world.load(load_room(RoomId(scene, number)))
            counts.append(len(build_pose_graph(world).positions))
    least, most = POSITIONS[scene]
    assert least <= min(counts)
    assert max(counts) <= most
    # An apartment has 2.4 times as many as a room, of which our mean is 140.
    medians = {"kitchen": 104, "living_room": 202, "bedroom": 141, "bathroom": 79, "apartment": 2.4 * 140}
    assert statistics.median(counts) == pytest.approx(medians[scene], rel=0.15)
    # Homes vary: the largest rooms have at least twice the smallest ones' floor; apartments were made to be alike.
    assert max(counts) >= (1.25 if scene == "apartment" else 2) * min(counts)


@pytest.mark.parametrize("scene", SCENES)
def test_rooms_of_the_catalogue_are_accepted(scene: str) -> None:
    assert find_fault(load_room(RoomId(scene, 29))) is None


def test_a_room_with_a_hidden_target_is_not_accepted() -> None:
    room = load_room(RoomId("bathroom", 3))
    (switch,) = (item for item in room.items if item.category == "LightSwitch")
    centre = tuple((low + high) / 2 for low, high in zip(switch.low, switch.high, strict=True))
    cover = block("Painting", (0.2, 0.2, 0.2), centre)  # type: ignore[arg-type]
    hidden = dataclasses.replace(room, items=(*room.items, cover))
    assert find_fault(hidden) == "LightSwitch cannot be reached and seen"


def test_a_room_without_its_fixtures_or_cut_in_two_is_not_accepted() -> None:
    room = load_room(RoomId("bathroom", 3))
    no_sink = dataclasses.replace(room, items=tuple(item for item in room.items if item.category != "Sink"))
    assert find_fault(no_sink) == "no Sink"
    fence = block("Fence", (0.02, room.depth, 0.4), (round(room.width / 2 / GRID_M) * GRID_M, room.depth / 2, 0.3))
    fault = find_fault(dataclasses.replace(room, items=(*room.items, fence)))
    assert fault is not None
    assert "positions" in fault
