"""Makes rooms from their names, in plain Python: no simulator, and the same room on every machine."""

from collections.abc import Callable
from random import Random
from typing import Final

from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.generator import bathroom, bedroom, kitchen, living_room
from hoz_dist.sim.generator.apartment import make_apartment
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.shell import shell
from hoz_dist.sim.room import Room

_FURNISH: Final[dict[str, Callable[[FloorPlan], None]]] = {
    "kitchen": kitchen.furnish,
    "living_room": living_room.furnish,
    "bedroom": bedroom.furnish,
    "bathroom": bathroom.furnish,
}
_EXTENTS: Final[dict[str, tuple[tuple[int, int], tuple[int, int]]]] = {
    "kitchen": ((3100, 4800), (3300, 5000)),
    "living_room": ((4700, 7000), (4300, 6300)),
    "bedroom": ((4000, 5500), (3900, 5500)),
    "bathroom": ((2300, 3700), (2500, 4000)),
}
"""Least and greatest inner extents of the walls, mm: the field's reachable extents and about 1 m of furniture."""
_FLOORS: Final[dict[str, tuple[str, ...]]] = {
    "kitchen": ("tile_floor", "tile_floor", "wood_floor"),
    "living_room": ("wood_floor", "wood_floor", "carpet"),
    "bedroom": ("wood_floor", "carpet"),
    "bathroom": ("tile_floor",),
}


def generate_room(room: RoomId, attempt: int) -> Room:
    """Make a room; it follows from the arguments alone.

    Args:
        room: Which room.
        attempt: Counts the tries to make a room whose targets can all be reached and seen.
    """
    rng = Random(f"hoz-dist {room} {attempt}")
    if room.scene == "apartment":
        return make_apartment(room, rng)
    (least_width, most_width), (least_depth, most_depth) = _EXTENTS[room.scene]
    plan = FloorPlan(
        rng,
        width=rng.randrange(least_width, most_width, 10),
        depth=rng.randrange(least_depth, most_depth, 10),
        height=rng.randrange(2400, 2800, 10),
    )
    tiles = rng.choice((0, 1200)) if room.scene == "bathroom" else 0
    walls = shell(plan, rng.choice(_FLOORS[room.scene]), tiles=tiles)
    _FURNISH[room.scene](plan)
    # The walls come last: PyBullet draws in this order and spends no time on what is hidden by things drawn before.
    return Room(room, plan.width / 1000, plan.depth / 1000, (*plan.items, walls.item))
