"""Apartments: rooms that open into each other, each with what belongs there.

What is seen near tells what is far: pots are in kitchens, alarm clocks beside beds, televisions opposite sofas.
"""

from random import Random
from typing import Final

from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.generator.apartment_layout import THICK, draw_layout
from hoz_dist.sim.generator.apartment_rooms import FURNISH
from hoz_dist.sim.generator.apartment_things import distribute
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.palette import Colour, paint
from hoz_dist.sim.generator.shell import Opening, shell
from hoz_dist.sim.generator.solids import Model, Placed, Rect, box
from hoz_dist.sim.room import Item, Room

_ROOMS: Final[dict[tuple[str, ...], int]] = {
    ("living", "kitchen", "bedroom", "study"): 45,
    ("living", "kitchen", "bedroom", "bath"): 30,
    ("living", "kitchen", "bedroom"): 25,
}
"""Kinds of rooms, and how many of 100 apartments have them."""
_FLOORS: Final[dict[str, tuple[str, ...]]] = {
    "living": ("wood_floor", "wood_floor", "carpet"),
    "kitchen": ("tile_floor", "tile_floor", "wood_floor"),
    "bedroom": ("wood_floor", "carpet"),
    "study": ("wood_floor", "carpet"),
    "bath": ("tile_floor",),
}
_DOORWAY_ACCESS: Final = 850
"""Free floor on either side of a doorway."""
_CASING: Final = 70
"""Width of the boards around a doorway."""


def make_apartment(name: RoomId, rng: Random) -> Room:
    """Make an apartment.

    Args:
        name: Which one.
        rng: Where all choices come from.
    """
    layout = draw_layout(rng, rng.choices(list(_ROOMS), list(_ROOMS.values()))[0])
    height = rng.randrange(2400, 2800, 10)
    trim = paint(rng, rng.choice(("white", "white", "wood")))
    plans: dict[str, FloorPlan] = {}
    shells: list[Placed] = []
    for number, cell in enumerate(layout.cells):
        inside = cell.inside
        width, depth = inside.x1 - inside.x0, inside.z1 - inside.z0
        plan = FloorPlan(rng, width, depth, height, outer=layout.outer_walls(number))
        openings = layout.openings(number)
        shells.append(shell(plan, rng.choice(_FLOORS[cell.kind]), thick=THICK, openings=openings))
        barred = [_bar(plan, opening) for opening in openings]
        FURNISH[cell.kind](plan)
        for opening, bar in zip(openings, barred, strict=True):
            plan.placed[plan.placed.index(bar)] = Placed.of(_casing(opening, trim), bar.spot)
        plans[cell.kind] = plan
    distribute(rng, plans)
    things = [item for cell in layout.cells for item in _moved(plans[cell.kind].placed, cell.inside)]
    walls = [item for cell, placed in zip(layout.cells, shells, strict=True) for item in _moved([placed], cell.inside)]
    return Room(name, layout.width / 1000, layout.depth / 1000, (*things, *walls))


def _bar(plan: FloorPlan, opening: Opening) -> Placed:
    """Keep a doorway and the floor in front of it free, by a thing that fills it until the room is furnished."""
    middle, half = (opening.start + opening.end) // 2, (opening.end - opening.start) // 2 + _CASING
    front = Rect(opening.start - _CASING, 0, opening.end + _CASING, _DOORWAY_ACCESS)
    plan.keep_free(plan.wall_spot(opening.wall, 0).rect(front))
    bar = Model.of("Doorway", [box((-half, half), (0, 30), (0, opening.height + _CASING), (0.0, 0.0, 0.0))])
    return plan.add(bar, plan.wall_spot(opening.wall, middle))


def _casing(opening: Opening, colour: Colour) -> Model:
    """The boards around a doorway, on one side of the wall."""
    half, top, out = (opening.end - opening.start) // 2, opening.height, (0, 20)
    return Model.of(
        "Doorway",
        [
            box((-half - _CASING, -half), out, (0, top + _CASING), colour),
            box((half, half + _CASING), out, (0, top + _CASING), colour),
            box((-half, half), out, (top, top + _CASING), colour),
        ],
    )


def _moved(placed: list[Placed], room: Rect) -> list[Item]:
    """Return what was placed in a room in the apartment's coordinates."""
    return [
        Placed.of(one.model, one.spot._replace(x=one.spot.x + room.x0, z=one.spot.z + room.z0)).item for one in placed
    ]
