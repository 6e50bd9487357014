"""What PyBullet makes of apartments: walls hide what is behind them, and the agent gets into every room."""

import dataclasses

import numpy as np
import pytest

from hoz_dist.nav.pose import GRID_M
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.camera import Camera
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.pose_graph import build_pose_graph
from hoz_dist.sim.room import Room
from hoz_dist.sim.world import World

pytestmark = pytest.mark.integration


def without_walls(room: Room) -> Room:
    return dataclasses.replace(room, items=tuple(item for item in room.items if item.category != "Walls"))


def test_walls_hide_what_is_behind_them() -> None:
    room = load_room(RoomId("apartment", 1))
    bare = without_walls(room)
    things = {item.category for item in bare.items}
    with World(room) as world, World(bare) as open_world:
        graph = build_pose_graph(world)
        chosen = np.random.default_rng(0).integers(graph.views, size=60)
        seen, behind = [], []
        for view in chosen:
            pose = graph.pose(view)
            real, open_air = Camera(world, 64).render(pose), Camera(open_world, 64).render(pose)
            seen.append(names(room, real.segmentation) & things)
            behind.append(names(bare, open_air.segmentation))
            # A wall only hides: what is seen in spite of it is seen at the same distance.
            shown = np.isin(real.segmentation, [n + 1 for n, item in enumerate(room.items) if item.category != "Walls"])
            np.testing.assert_allclose(real.depth[shown], open_air.depth[shown], atol=1e-3)
    assert all(mine <= theirs for mine, theirs in zip(seen, behind, strict=True))
    assert 1.5 * sum(map(len, seen)) < sum(map(len, behind))


def names(room: Room, segmentation: np.ndarray) -> set[str]:
    return {room.items[label - 1].category for label in np.unique(segmentation) if label}


@pytest.mark.parametrize("number", [1, 62, 70])
def test_the_agent_gets_into_every_room_and_through_no_wall(number: int) -> None:
    room = load_room(RoomId("apartment", number))
    with World(room) as world:
        places = build_pose_graph(world).positions * GRID_M
    for walls in (item for item in room.items if item.category == "Walls"):
        inside = (places > np.array(walls.low[:2])).all(axis=1) & (places < np.array(walls.high[:2])).all(axis=1)
        assert inside.sum() >= 10
    with World(without_walls(room)) as world:
        assert len(build_pose_graph(world).positions) > len(places)
