"""Kitchen appliances and the worktops that they stand on."""

from dataclasses import dataclass
from random import Random
from typing import Final, Self

from hoz_dist.sim.generator.palette import Colour, paint, shade
from hoz_dist.sim.generator.solids import Model, Rect, Solid, Spot, Top, box, cylinder, vary

_TOE: Final = 90
"""Height of the recess under a cabinet."""
_SLAB: Final = 40
"""Thickness of a worktop."""
BASIN_DEPTH: Final = 150
"""Height of a basin below the worktop."""
_OVERHANG: Final = 40
"""Of a worktop over its cabinet."""
_DARK: Final[Colour] = (0.1, 0.1, 0.1)


@dataclass(frozen=True)
class CabinetStyle:
    """What the cabinets of one room share."""

    body: Colour
    top: Colour
    height: int
    """Of the worktops."""
    depth: int

    @classmethod
    def draw(cls, rng: Random, height: int = 920, depth: int = 640) -> Self:
        """Draw colours, and measures around the given ones."""
        return cls(paint(rng, "cabinet"), paint(rng, "worktop"), vary(rng, height, 3), vary(rng, depth, 4))


def counter(style: CabinetStyle, width: int) -> Model:
    """A base cabinet with a worktop."""
    half, depth, under = width // 2, style.depth, style.height - _SLAB
    solids = [
        *_carcass(style, (-half, half), under),
        box((-half, half), (0, depth), (under, style.height), style.top),
    ]
    return Model.of("Counter", solids, Top(Rect(-half + 20, 20, half - 20, depth - 30), style.height))


def sink_counter(style: CabinetStyle, width: int, basin: Model) -> Model:
    """A base cabinet whose worktop has a hole for a basin, see `hole_of`."""
    half, depth, under, low = width // 2, style.depth, style.height - _SLAB, style.height - BASIN_DEPTH - _SLAB
    front, hole = depth - _OVERHANG, hole_of(style, basin)
    solids = [
        *_carcass(style, (-half, half), low),
        box((-half, half), (hole.z1, front), (low, under), style.body),
        box((-half, hole.x0), (0, hole.z1), (low, under), style.body),
        box((hole.x1, half), (0, hole.z1), (low, under), style.body),
        box((-half, hole.x0), (0, depth), (under, style.height), style.top),
        box((hole.x1, half), (0, depth), (under, style.height), style.top),
        box((hole.x0, hole.x1), (0, hole.z0), (under, style.height), style.top),
        box((hole.x0, hole.x1), (hole.z1, depth), (under, style.height), style.top),
    ]
    sides = [
        Top(Rect(-half + 20, 20, hole.x0 - 40, depth - 30), style.height),
        Top(Rect(hole.x1 + 40, 20, half - 20, depth - 30), style.height),
    ]
    return Model("Counter", tuple(solids), tuple(top for top in sides if top.rect.x1 - top.rect.x0 > 100))


def hole_of(style: CabinetStyle, basin: Model) -> Rect:
    """Return where the basin's hollow passes through the worktop, in the counter's frame."""
    hollow = basin.solids[0].rect
    end = style.depth - 80
    return Rect(hollow.x0, end - hollow.z1, hollow.x1, end)


def basin_spot(style: CabinetStyle, basin: Model, counter_spot: Spot) -> Spot:
    """Return where the basin goes in a counter of `sink_counter` that stands at a spot."""
    x, z = counter_spot.point(0, hole_of(style, basin).z0)
    return Spot(x, z, counter_spot.height + style.height - BASIN_DEPTH, counter_spot.quarter)


def sink(rng: Random, width: int, depth: int) -> Model:
    """A basin with a hollow, a tap and a drain; it hangs in a worktop, the tap stands behind it."""
    width, depth = vary(rng, width, 12), vary(rng, depth, 6)
    half, colour, tap = width // 2, paint(rng, rng.choice(("steel", "steel", "ceramic"))), paint(rng, "steel")
    wall, rim, middle = 16, BASIN_DEPTH + 8, depth // 2
    return Model.of(
        "Sink",
        [
            box((-half, half), (0, depth), (0, 10), shade(colour, 70)),
            box((-half, half), (0, wall), (10, rim), colour),
            box((-half, half), (depth - wall, depth), (10, rim), colour),
            box((-half, -half + wall), (wall, depth - wall), (10, rim), shade(colour, 90)),
            box((half - wall, half), (wall, depth - wall), (10, rim), shade(colour, 90)),
            box((-25, 25), (middle - 25, middle + 25), (10, 14), _DARK),
            box((-18, 18), (-60, -24), (BASIN_DEPTH, BASIN_DEPTH + 210), tap),
            box((-14, 14), (-24, 130), (BASIN_DEPTH + 180, BASIN_DEPTH + 208), tap),
            box((30, 60), (-54, -30), (BASIN_DEPTH, BASIN_DEPTH + 60), tap),
        ],
    )


def _carcass(style: CabinetStyle, x: tuple[int, int], top: int) -> list[Solid]:
    """The cabinet under a worktop: recess, body and doors."""
    depth = style.depth - _OVERHANG
    count = max(1, min(3, (x[1] - x[0] + 250) // 650))
    step = (x[1] - x[0]) // count
    doors = [
        box(
            (x[0] + i * step + 12, x[0] + (i + 1) * step - 12),
            (depth, depth + 15),
            (_TOE + 20, top - 25),
            shade(style.body, 90),
        )
        for i in range(count)
    ]
    return [
        box(x, (0, depth - 50), (0, _TOE), shade(style.body, 40)),
        box(x, (0, depth), (_TOE, top), style.body),
        *doors,
    ]


def wall_cabinet(style: CabinetStyle, width: int) -> Model:
    """A cupboard that hangs over a worktop."""
    half, depth, height = width // 2, 330, 700
    count = max(1, min(3, (width + 200) // 600))
    step = width // count
    doors = [
        box(
            (-half + i * step + 10, -half + (i + 1) * step - 10),
            (depth - 20, depth),
            (15, height - 15),
            shade(style.body, 90),
        )
        for i in range(count)
    ]
    return Model.of("Cabinet", [box((-half, half), (0, depth - 20), (0, height), style.body), *doors])


def island(style: CabinetStyle, width: int) -> Model:
    """A free-standing counter."""
    half, depth, under = width // 2, 860, style.height - _SLAB
    solids = [
        box((-half + 60, half - 60), (60, depth - 60), (0, _TOE), shade(style.body, 40)),
        box((-half + 20, half - 20), (20, depth - 20), (_TOE, under), style.body),
        box((-half, half), (0, depth), (under, style.height), style.top),
    ]
    return Model.of("Island", solids, Top(Rect(-half + 30, 30, half - 30, depth - 30), style.height))


def stove(rng: Random, style: CabinetStyle) -> Model:
    """A range with an oven; its tops are the four places of the burners."""
    half, depth = vary(rng, 740, 3) // 2, style.depth
    body = paint(rng, "appliance")
    height = style.height
    solids = [
        box((-half, half), (0, depth - 30), (0, height - 20), body),
        box((-half, half), (0, depth), (height - 20, height), shade(body, 45)),
        box((-half + 60, half - 60), (depth - 30, depth - 10), (280, height - 220), _DARK),
        box((-half + 60, half - 60), (depth - 10, depth + 20), (height - 190, height - 165), shade(body, 70)),
        box((-half + 20, half - 20), (depth - 30, depth - 5), (height - 130, height - 40), shade(body, 60)),
        box((-half, half), (0, 50), (height, height + 110), body),
    ]
    tops = [
        Top(Rect(x - 150, z - 140, x + 150, z + 140), height)
        for x in (-half // 2, half // 2)
        for z in (200, depth - 160)
    ]
    return Model("Stove", tuple(solids), tuple(tops))


def burner(rng: Random, diameter: int) -> Model:
    """A gas ring; a pot or pan stands on it."""
    colour = paint(rng, "black")
    half = diameter // 2
    cap = half // 2
    plate = box((-half, half), (0, diameter), (0, 10), colour)
    ring = box((-cap, cap), (half - cap, half + cap), (10, 22), shade(colour, 180))
    return Model.of("StoveBurner", [plate, ring], Top(plate.rect, 22, centred=True))


def hood(rng: Random, width: int) -> Model:
    """An extractor over the stove."""
    half, colour = width // 2, paint(rng, "steel")
    return Model.of(
        "Hood",
        [
            box((-half, half), (0, 450), (0, 100), colour),
            box((-150, 150), (0, 280), (100, 650), shade(colour, 90)),
        ],
    )


def fridge(rng: Random) -> Model:
    """A refrigerator with a freezer."""
    width, depth, height = vary(rng, 940, 12), vary(rng, 720, 5), vary(rng, 1830, 6)
    colour = paint(rng, "appliance")
    half, split = width // 2, height * rng.choice((35, 40, 65, 70)) // 100
    front = depth - 50
    side = half - 90 if rng.random() < 0.5 else -half + 60
    return Model.of(
        "Fridge",
        [
            box((-half, half), (0, front - 40), (30, height), shade(colour, 85)),
            box((-half + 40, half - 40), (40, front - 100), (0, 30), _DARK),
            box((-half, half), (front - 40, front), (50, split - 8), colour),
            box((-half, half), (front - 40, front), (split + 8, height), colour),
            box((side, side + 30), (front, front + 50), (max(split - 480, 120), split - 60), shade(colour, 55)),
            box((side, side + 30), (front, front + 50), (split + 60, min(split + 480, height - 60)), shade(colour, 55)),
        ],
    )


def microwave(rng: Random) -> Model:
    """A microwave oven: body, window and control panel."""
    width, depth, height = vary(rng, 590, 12), vary(rng, 360, 10), vary(rng, 340, 10)
    half, panel = width // 2, width // 4
    body = paint(rng, "appliance")
    return Model.of(
        "Microwave",
        [
            box((-half, half), (0, depth - 20), (0, height), body),
            box((-half + 20, half - panel - 10), (depth - 20, depth), (25, height - 25), _DARK),
            box((half - panel, half - 15), (depth - 20, depth), (25, height - 25), shade(body, 75)),
            box((half - panel + 20, half - 35), (depth, depth + 6), (height - 90, height - 50), (0.25, 0.7, 0.45)),
        ],
    )


def toaster(rng: Random) -> Model:
    """A toaster with two slots and a lever."""
    width, depth, height = vary(rng, 330, 12), vary(rng, 220, 10), vary(rng, 205, 10)
    half, colour = width // 2, paint(rng, "toaster")
    slots = [box((-half + 40, half - 40), (z, z + 30), (height - 4, height), _DARK) for z in (50, depth - 80)]
    body = box((-half, half), (0, depth), (15, height - 4), colour)
    foot = box((-half + 15, half - 15), (15, depth - 15), (0, 15), _DARK)
    lever = box((half, half + 25), (depth // 2 - 20, depth // 2 + 20), (110, 130), _DARK)
    return Model.of("Toaster", [foot, body, lever, *slots])


def coffee_machine(rng: Random) -> Model:
    """A coffee machine: tank at the back, head above, and a jug on the plate."""
    width, depth, height = vary(rng, 390, 15), vary(rng, 410, 10), vary(rng, 430, 10)
    half, colour = width // 2, paint(rng, "coffee_machine")
    tank = depth * 2 // 5
    jug_height = height // 3
    return Model.of(
        "CoffeeMachine",
        [
            box((-half, half), (0, tank), (0, height), colour),
            box((-half, half), (tank, depth), (height * 2 // 3, height), colour),
            box((-half, half), (tank, depth), (0, 40), shade(colour, 140)),
            cylinder(0, (tank + depth) // 2, min(depth - tank, width) - 50, (40, 40 + jug_height), (0.45, 0.30, 0.20)),
            box((-half + 40, half - 40), (depth, depth + 6), (height * 2 // 3 + 30, height - 30), (0.75, 0.12, 0.1)),
        ],
    )
