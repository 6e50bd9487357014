"""Floor, walls, ceiling, and what belongs to the walls: door, light switch, windows, pictures."""

from collections.abc import Iterable, Sequence
from random import Random
from typing import Final, NamedTuple

from hoz_dist.sim.generator.floor_plan import WALLS, FloorPlan
from hoz_dist.sim.generator.palette import Colour, paint, shade
from hoz_dist.sim.generator.solids import Model, Placed, Rect, Solid, Spot, box, vary

_THICK: Final = 100
"""Of floor, walls and ceiling."""
_DOOR_ACCESS: Final = 900
"""Free floor in front of the door."""
_SWITCH_WIDTH: Final = 130
_WINDOW_TRIES: Final = 12


class Opening(NamedTuple):
    """A hole in a wall, from the floor up."""

    wall: int
    start: int
    """Where it begins along the wall, see `FloorPlan.wall_spot`."""
    end: int
    height: int


def shell(
    plan: FloorPlan, floor: str, *, tiles: int = 0, thick: int = _THICK, openings: Sequence[Opening] = ()
) -> Placed:
    """Make floor, ceiling and walls, one body around the room's inside.

    Args:
        plan: The room.
        floor: Material of the floor.
        tiles: Height to which the walls are tiled, mm.
        thick: Thickness of floor, walls and ceiling, mm.
        openings: Ways through the walls.
    """
    rng, width, depth, height = plan.rng, plan.width, plan.depth, plan.height
    wall = paint(rng, "wall")
    walls = [wall] * 4
    if rng.random() < 0.4:
        walls[rng.choice(WALLS)] = paint(rng, "wall")
    tile = paint(rng, "tile_floor")
    outside = ((-thick, width + thick), (-thick, depth + thick))
    solids = [
        box(*outside, (-thick, 0), paint(rng, floor)),
        box(*outside, (height, height + thick), paint(rng, "ceiling")),
    ]
    sides = (
        (outside[0], (-thick, 0)),
        ((-thick, 0), (0, depth)),
        (outside[0], (depth, depth + thick)),
        ((width, width + thick), (0, depth)),
    )
    for number, ((x, z), colour) in enumerate(zip(sides, walls, strict=True)):
        holes = [_hole(plan, opening, thick) for opening in openings if opening.wall == number]
        solids += _pierced(box(x, z, (tiles, height), colour), holes)
        if tiles:
            solids += _pierced(box(x, z, (0, tiles), tile), holes)
    return Placed.of(Model.of("Walls", solids), Spot(0, 0))


def _hole(plan: FloorPlan, opening: Opening, thick: int) -> Solid:
    """Return the space that an opening takes out of its wall."""
    rect = plan.wall_spot(opening.wall, 0).rect(Rect(opening.start, -thick, opening.end, 0))
    return box((rect.x0, rect.x1), (rect.z0, rect.z1), (0, opening.height), (0.0, 0.0, 0.0))


def _pierced(wall: Solid, holes: Iterable[Solid]) -> list[Solid]:
    """Return what holes through the thickness of a wall leave of it: beside them and above."""
    pieces = [wall]
    for hole in holes:
        pieces = [piece for whole in pieces for piece in (_without(whole, hole) if whole.meets(hole) else [whole])]
    return pieces


def _without(wall: Solid, hole: Solid) -> list[Solid]:
    along_x = wall.x[1] - wall.x[0] > wall.z[1] - wall.z[0]
    span, gap = (wall.x, hole.x) if along_x else (wall.z, hole.z)
    sides = [(span[0], gap[0]), (gap[1], span[1])]
    pieces = [wall._replace(x=side) if along_x else wall._replace(z=side) for side in sides if side[0] < side[1]]
    if hole.h[1] < wall.h[1]:
        above = wall._replace(h=(hole.h[1], wall.h[1]))
        pieces.append(above._replace(x=gap) if along_x else above._replace(z=gap))
    return pieces


def entrance(plan: FloorPlan, walls: tuple[int, ...]) -> None:
    """Place the door, with free floor in front of it, and the light switch beside it.

    Args:
        plan: The room.
        walls: Walls that may hold the door, in order of preference.
    """
    rng = plan.rng
    model = _door(rng)
    for wall in walls:
        room = model.width // 2 + 80
        places = list(range(room, plan.wall_length(wall) - room, 50))
        rng.shuffle(places)
        for along in places:
            spot = plan.wall_spot(wall, along)
            side = rng.choice((-1, 1))
            for sign in (side, -side):
                switch_along = along + sign * (model.width // 2 + rng.randint(110, 220))
                switch_spot = plan.wall_spot(wall, switch_along, rng.randint(1180, 1320))
                switch = _light_switch(rng)
                low, high = (
                    min(along - model.width // 2, switch_along - 150),
                    max(along + model.width // 2, switch_along + 150),
                )
                if low < 0 or high > plan.wall_length(wall):
                    continue
                access = plan.wall_spot(wall, 0).rect(Rect(low, 0, high, _DOOR_ACCESS))
                if plan.fits(model, spot) and plan.fits(switch, switch_spot) and plan.is_clear(access):
                    plan.add(model, spot)
                    plan.add(switch, switch_spot)
                    plan.keep_free(access)
                    return


def _door(rng: Random) -> Model:
    """A closed door: leaf, panels, frame and handle."""
    width, height = vary(rng, 840, 6), vary(rng, 2040, 2)
    half, frame = width // 2, 70
    colour, trim = paint(rng, rng.choice(("white", "wood"))), paint(rng, "white")
    panels = [
        box((-half + 120, half - 120), (25, 30), h, shade(colour, 88))
        for h in ((180, height // 2 - 120), (height // 2 + 80, height - 160))
    ]
    side = half - 60 if rng.random() < 0.5 else -half + 60
    return Model.of(
        "Door",
        [
            box((-half, half), (0, 25), (0, height), colour),
            *panels,
            box((-half - frame, -half), (0, 32), (0, height + frame), trim),
            box((half, half + frame), (0, 32), (0, height + frame), trim),
            box((-half, half), (0, 32), (height, height + frame), trim),
            box((side - 40, side + 40), (25, 45), (1000, 1025), paint(rng, "steel")),
        ],
    )


def _light_switch(rng: Random) -> Model:
    """A switch plate with a rocker."""
    half, height = vary(rng, _SWITCH_WIDTH, 8) // 2, vary(rng, 150, 8)
    colour = paint(rng, "switch")
    return Model.of(
        "LightSwitch",
        [
            box((-half, half), (0, 16), (0, height), colour),
            box((-half // 2, half // 2), (16, 30), (height // 4, height * 3 // 4), shade(colour, 80)),
        ],
    )


def window(rng: Random, width: int, *, curtains: bool) -> Model:
    """A window, some with curtains; its base is the sill."""
    half, height, frame = width // 2, vary(rng, 1050, 8), 60
    white, curtain = paint(rng, "white"), paint(rng, "curtain")
    solids: list[Solid] = [
        box((-half, half), (0, 12), (0, height), paint(rng, "pane")),
        box((-half - frame, -half), (0, 30), (-frame, height + frame), white),
        box((half, half + frame), (0, 30), (-frame, height + frame), white),
        box((-half, half), (0, 30), (height, height + frame), white),
        box((-half, half), (0, 40), (-frame, 0), white),
        box((-15, 15), (12, 28), (0, height), white),
    ]
    if curtains:
        sides = ((-half - 200, -half + 80), (half - 80, half + 200))
        solids += [box(x, (32, 48), (-250, height + 120), curtain) for x in sides]
    return Model.of("Window", solids)


def windows(plan: FloorPlan, count: int, *, curtains: bool) -> None:
    """Place windows wherever an outer wall is free at their height, furniture below or not."""
    rng = plan.rng
    for _ in range(count):
        model = window(rng, vary(rng, 1100, 25), curtains=curtains)
        _on_wall(plan, model, plan.outer, rng.randint(950, 1050))


def pictures(plan: FloorPlan, count: int) -> None:
    """Hang pictures."""
    for _ in range(count):
        rng = plan.rng
        half, height, edge = rng.randint(180, 450), rng.randint(300, 700), 25
        frame, image = paint(rng, rng.choice(("wood", "black", "white"))), paint(rng, "picture")
        model = Model.of(
            "Painting",
            [
                box((-half, half), (0, 20), (0, height), frame),
                box((-half + edge, half - edge), (20, 24), (edge, height - edge), image),
                box((-half // 2, half // 3), (24, 26), (height // 4, height // 2), paint(rng, "picture")),
            ],
        )
        _on_wall(plan, model, WALLS, rng.randint(1250, 1450))


def _on_wall(plan: FloorPlan, model: Model, walls: Sequence[int], height: int) -> Placed | None:
    rng = plan.rng
    for _ in range(_WINDOW_TRIES):
        wall = rng.choice(walls)
        edge = model.width // 2 + 60
        if 2 * edge >= plan.wall_length(wall):
            continue
        spot = plan.wall_spot(wall, rng.randint(edge, plan.wall_length(wall) - edge), height)
        if plan.fits(model, spot, 20):
            return plan.add(model, spot)
    return None


def rug(rng: Random, width: int, depth: int) -> Model:
    """A rug with a border."""
    half, colour, inner = width // 2, paint(rng, "rug"), 90
    middle: Colour = shade(colour, rng.choice((75, 130)))
    return Model.of(
        "Rug",
        [
            box((-half, half), (0, depth), (0, 6), colour),
            box((-half + inner, half - inner), (inner, depth - inner), (6, 10), middle),
        ],
    )


def free_rug(plan: FloorPlan, width: int, depth: int) -> None:
    """Lay a rug where the floor is free; ways that stay free for the agent may have rugs."""
    rng = plan.rng
    model = rug(rng, vary(rng, width, 20), vary(rng, depth, 20))
    for _ in range(40):
        spot = Spot(rng.randint(0, plan.width), rng.randint(0, plan.depth), 0, rng.choice(WALLS))
        if plan.fits(model, spot, 30, on_ways=True):
            plan.add(model, spot)
            return
