"""Rooms of the catalogue, made once for all tests of a process."""

from functools import cache

from hoz_dist.nav.categories import ROOM_SCENES
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.room import Room

NUMBERS = {**dict.fromkeys(ROOM_SCENES, range(1, 31)), "apartment": range(1, 76, 4)}
"""All rooms; of apartments, which take longer, every fourth."""


@cache
def rooms(scene: str) -> tuple[Room, ...]:
    return tuple(load_room(RoomId(scene, number)) for number in NUMBERS[scene])
