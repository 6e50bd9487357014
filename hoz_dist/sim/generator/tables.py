"""Furniture that things stand on: tables, desks, dressers, shelves."""

from random import Random
from typing import Final

from hoz_dist.sim.generator.palette import Colour, paint, shade
from hoz_dist.sim.generator.solids import Model, Rect, Solid, Top, box, vary

_EDGE: Final = 30
"""Things stand at least this far from the edge of a top."""


def _top(width: int, depth: int, height: int, clear: int = 2000) -> Top:
    half = width // 2 - _EDGE
    return Top(Rect(-half, _EDGE, half, depth - _EDGE), height, clear)


def _slab(width: int, depth: int, h: tuple[int, int], colour: Colour) -> Solid:
    return box((-width // 2, width // 2), (0, depth), h, colour)


def _legs(width: int, depth: int, height: int, thick: int, colour: Colour) -> list[Solid]:
    """Four legs at the corners of a footprint."""
    half = width // 2
    return [
        box((x, x + thick), (z, z + thick), (0, height), colour)
        for x in (-half, half - thick)
        for z in (0, depth - thick)
    ]


def _four_legged(category: str, rng: Random, size: tuple[int, int, int], material: str, thick: int) -> Model:
    """A slab on four legs; size is width, depth, height."""
    width, depth, height = size
    colour = paint(rng, material)
    board = 40
    solids = [
        *_legs(width, depth, height - board, thick, shade(colour, 85)),
        _slab(width, depth, (height - board, height), colour),
    ]
    return Model.of(category, solids, _top(width, depth, height))


def dining_table(rng: Random, percent: int = 100) -> Model:
    """A dining table; percent shrinks it for small rooms."""
    size = (vary(rng, 1470) * percent // 200 * 2, vary(rng, 960) * percent // 200 * 2, vary(rng, 760, 3))
    return _four_legged("DiningTable", rng, size, "wood", 70)


def coffee_table(rng: Random) -> Model:
    """A low table, some with a shelf under the top."""
    width, depth, height = vary(rng, 1130, 20), vary(rng, 660), vary(rng, 440, 10)
    table = _four_legged("CoffeeTable", rng, (width, depth, height), "wood", 60)
    if rng.random() < 0.5:
        shelf = box((-width // 2 + 60, width // 2 - 60), (60, depth - 60), (120, 150), paint(rng, "wood"))
        return Model(table.category, (*table.solids, shelf), table.tops)
    return table


def side_table(rng: Random) -> Model:
    """A bed-side or sofa-side table with a drawer."""
    width, depth, height = vary(rng, 600), vary(rng, 410, 10), vary(rng, 640, 8)
    colour = paint(rng, "wood")
    front = shade(colour, 80)
    solids = [
        *_legs(width, depth - 20, height // 2, 40, front),
        box((-width // 2, width // 2), (0, depth - 20), (height // 2, height), colour),
        box((-width // 2 + 30, width // 2 - 30), (depth - 20, depth), (height // 2 + 30, height - 40), front),
    ]
    return Model.of("SideTable", solids, _top(width, depth - 20, height))


def desk(rng: Random) -> Model:
    """A desk: a top on a drawer block and a side, open for a chair."""
    width, depth, height = vary(rng, 1360), vary(rng, 630, 8), vary(rng, 780, 4)
    colour = paint(rng, "wood")
    half, block, board, under = width // 2, 380, 40, height - 40
    if rng.random() < 0.5:
        drawers_x, knees_x, side_x = (-half, -half + block), (-half + block, half - board), (half - board, half)
    else:
        drawers_x, knees_x, side_x = (half - block, half), (-half + board, half - block), (-half, -half + board)
    step = (under - 100) // 3
    fronts = [
        box((drawers_x[0] + 20, drawers_x[1] - 20), (depth - 20, depth), (h, h + step - 20), shade(colour, 75))
        for h in range(80, 80 + 3 * step, step)
    ]
    solids = [
        _slab(width, depth, (under, height), colour),
        box(drawers_x, (0, depth - 20), (0, under), shade(colour, 90)),
        box(side_x, (0, depth), (0, under), shade(colour, 90)),
        box(knees_x, (0, 20), (height // 2, under), shade(colour, 80)),
        *fronts,
    ]
    return Model.of("Desk", solids, _top(width, depth, height))


def dresser(rng: Random) -> Model:
    """A chest of drawers."""
    width, depth, height = vary(rng, 1200), vary(rng, 500, 8), vary(rng, 950, 10)
    colour = paint(rng, "wood")
    front = shade(colour, 78)
    rows = 3
    step = (height - 100) // rows
    drawers = [
        box(x, (depth - 20, depth), (80 + row * step, 60 + (row + 1) * step), front)
        for row in range(rows)
        for x in ((-width // 2 + 20, -15), (15, width // 2 - 20))
    ]
    body = box((-width // 2, width // 2), (0, depth - 20), (0, height), colour)
    return Model.of("Dresser", [body, *drawers], _top(width, depth - 20, height))


def tv_stand(rng: Random) -> Model:
    """A low cabinet for a television."""
    width, depth, height = vary(rng, 1400), vary(rng, 430, 8), vary(rng, 560)
    colour = paint(rng, rng.choice(("wood", "wood", "white", "black")))
    third = width // 3
    solids = [
        box((-width // 2, width // 2), (0, depth - 20), (60, height), colour),
        box((-width // 2 + 40, width // 2 - 40), (40, depth - 60), (0, 60), shade(colour, 60)),
        box((-width // 2 + 20, -third // 2 - 10), (depth - 20, depth), (80, height - 20), shade(colour, 80)),
        box((third // 2 + 10, width // 2 - 20), (depth - 20, depth), (80, height - 20), shade(colour, 80)),
    ]
    return Model.of("TVStand", solids, _top(width, depth - 20, height))


def shelf(rng: Random) -> Model:
    """A standing bookcase with rows of books; its boards hold small things."""
    width, depth, boards = vary(rng, 850), vary(rng, 300, 8), rng.randint(3, 5)
    colour = paint(rng, rng.choice(("wood", "wood", "white")))
    step, half = 380, width // 2
    height = boards * step + 60
    solids = [
        box((-half, -half + 30), (0, depth), (0, height), colour),
        box((half - 30, half), (0, depth), (0, height), colour),
        box((-half + 30, half - 30), (0, 20), (0, height), shade(colour, 70)),
    ]
    tops = []
    for row in range(boards + 1):
        h = 30 + row * step
        solids.append(box((-half + 30, half - 30), (20, depth), (h, h + 30), colour))
        if row < boards and rng.random() < 0.6:
            span = (width - 60) * rng.randint(35, 65) // 100
            row_of_books = box(
                (-half + 40, -half + 40 + span),
                (40, depth - 60),
                (h + 30, h + 30 + rng.randint(180, 290)),
                paint(rng, "book"),
            )
            solids.append(row_of_books)
            tops.append(Top(Rect(-half + 60 + span, 30, half - 40, depth - 10), h + 30, step - 40))
        elif 1 <= row < boards:
            tops.append(Top(Rect(-half + 40, 30, half - 40, depth - 10), h + 30, step - 40))
    return Model("Shelf", tuple(solids), tuple(top for top in tops if 400 <= top.height <= 1300))


def wardrobe(rng: Random) -> Model:
    """A tall cupboard with two doors."""
    width, depth, height = vary(rng, 1400, 20), vary(rng, 600, 6), vary(rng, 2050, 4)
    colour = paint(rng, rng.choice(("wood", "wood", "white")))
    half = width // 2
    solids = [
        box((-half, half), (0, depth - 20), (0, height), colour),
        box((-half + 20, -8), (depth - 20, depth), (70, height - 30), shade(colour, 88)),
        box((8, half - 20), (depth - 20, depth), (70, height - 30), shade(colour, 88)),
    ]
    return Model.of("Wardrobe", solids)
