"""Small things, and large ones of which an apartment has few: each in the room where it is mostly used.

RoboTHOR has one of most of them in an apartment. Shares of receptacles follow the field's statistics.
"""

from collections.abc import Callable, Mapping
from random import Random
from typing import Final, NamedTuple, TypeVar

from hoz_dist.sim.generator import appliances, seating, small_things
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.solids import Model

_Key = TypeVar("_Key")


class _Thing(NamedTuple):
    """What lies or stands on furniture."""

    make: Callable[[Random], Model]
    chance: int
    """Of 100 apartments, how many have it if there is room for it."""
    places: Mapping[tuple[str, str], int]
    """Weight of each kind of room and category of receptacle in it."""
    turn: bool = False
    """Whether it may look any way."""


_COUNTER: Final = {("kitchen", "Counter"): 1}
_THINGS: Final = (
    _Thing(appliances.microwave, 85, _COUNTER),
    _Thing(small_things.pot, 96, {("kitchen", "StoveBurner"): 55, ("kitchen", "Counter"): 45}),
    _Thing(appliances.coffee_machine, 75, _COUNTER),
    _Thing(appliances.toaster, 60, _COUNTER),
    _Thing(small_things.kettle, 45, _COUNTER, turn=True),
    _Thing(small_things.pan, 45, {("kitchen", "StoveBurner"): 60, ("kitchen", "Counter"): 40}),
    _Thing(
        small_things.alarm_clock,
        96,
        {("bedroom", "SideTable"): 68, ("bedroom", "Dresser"): 18, ("bedroom", "Desk"): 6, ("study", "Desk"): 8},
    ),
    _Thing(
        small_things.desk_lamp,
        96,
        {
            ("bedroom", "SideTable"): 30,
            ("living", "SideTable"): 20,
            ("study", "Desk"): 30,
            ("bedroom", "Desk"): 8,
            ("bedroom", "Dresser"): 12,
        },
    ),
    _Thing(
        small_things.laptop,
        96,
        {
            ("study", "Desk"): 40,
            ("bedroom", "Desk"): 15,
            ("living", "CoffeeTable"): 15,
            ("living", "DiningTable"): 10,
            ("living", "Sofa"): 8,
            ("bedroom", "Bed"): 12,
        },
    ),
    _Thing(
        small_things.book,
        96,
        {
            ("living", "CoffeeTable"): 20,
            ("study", "Desk"): 22,
            ("study", "Shelf"): 18,
            ("living", "Shelf"): 15,
            ("bedroom", "SideTable"): 12,
            ("bedroom", "Bed"): 13,
        },
        turn=True,
    ),
    _Thing(
        small_things.plate,
        96,
        {("kitchen", "DiningTable"): 32, ("living", "DiningTable"): 30, ("kitchen", "Counter"): 38},
    ),
    _Thing(
        small_things.bowl,
        96,
        {
            ("kitchen", "DiningTable"): 28,
            ("living", "DiningTable"): 22,
            ("kitchen", "Counter"): 30,
            ("living", "CoffeeTable"): 12,
            ("living", "Dresser"): 8,
        },
    ),
    _Thing(
        small_things.cell_phone,
        96,
        {
            ("study", "Desk"): 26,
            ("bedroom", "SideTable"): 22,
            ("bedroom", "Bed"): 14,
            ("bedroom", "Dresser"): 10,
            ("living", "CoffeeTable"): 16,
            ("living", "SideTable"): 6,
            ("living", "Sofa"): 6,
        },
        turn=True,
    ),
    _Thing(
        small_things.remote_control,
        70,
        {("living", "CoffeeTable"): 40, ("living", "SideTable"): 15, ("living", "Sofa"): 25, ("living", "TVStand"): 20},
        turn=True,
    ),
    _Thing(small_things.book, 25, {("study", "Shelf"): 60, ("living", "Shelf"): 40}, turn=True),
)
"""The larger ones first: they find room where a phone would also fit."""
_SECOND_CAN: Final = 35
_SECOND_LAMP: Final = 15


def distribute(rng: Random, rooms: Mapping[str, FloorPlan]) -> None:
    """Put things into the furnished rooms of an apartment.

    Args:
        rng: Where all choices come from.
        rooms: The rooms by kind.
    """
    if not rooms["living"].has("Television") or rng.random() < 0.1:
        rooms["bedroom"].put(small_things.television(rng, 800, on_wall=False), {"Dresser": 1})
    if not any(plan.has("Chair") for plan in rooms.values()):
        _against_a_wall(rng, rooms, seating.chair, {"living": 1, "kitchen": 1, "bedroom": 1}, access=400)
    if not rooms["living"].has("FloorLamp") or rng.randrange(100) < _SECOND_LAMP:
        _against_a_wall(rng, rooms, small_things.floor_lamp, {"living": 60, "study": 25, "bedroom": 15}, access=200)
    cans = {"kitchen": 50, "living": 15, "study": 15, "bath": 12, "bedroom": 8}
    for _ in range(1 + (rng.randrange(100) < _SECOND_CAN)):
        without = {kind: plan for kind, plan in rooms.items() if not plan.has("GarbageCan")}
        _against_a_wall(rng, without, small_things.garbage_can, cans, access=300)
    for thing in _THINGS:
        if rng.randrange(100) < thing.chance:
            _put(rng, rooms, thing)


def _against_a_wall(
    rng: Random,
    rooms: Mapping[str, FloorPlan],
    make: Callable[[Random], Model],
    weights: Mapping[str, int],
    access: int,
) -> None:
    """Place a thing at a wall of one of the rooms, tried in an order drawn by weight."""
    model = make(rng)
    for kind in _in_drawn_order(rng, {kind: weight for kind, weight in weights.items() if kind in rooms}):
        if rooms[kind].against_wall(model, rooms[kind].any_walls(), access=access):
            return


def _put(rng: Random, rooms: Mapping[str, FloorPlan], thing: _Thing) -> None:
    """Put a thing on a receptacle in one of the rooms, tried in an order drawn by weight."""
    model = thing.make(rng)
    for kind, receptacle in _in_drawn_order(rng, {one: thing.places[one] for one in thing.places if one[0] in rooms}):
        if rooms[kind].put(model, {receptacle: 1}, turn=thing.turn):
            return


def _in_drawn_order(rng: Random, weights: Mapping[_Key, int]) -> list[_Key]:
    """Return keys in an order drawn by weight."""
    remaining, order = dict(weights), []
    while remaining:
        key = rng.choices(list(remaining), list(remaining.values()))[0]
        del remaining[key]
        order.append(key)
    return order
