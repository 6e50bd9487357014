"""Furniture to sit and lie on."""

from random import Random

from hoz_dist.sim.generator.palette import paint, shade
from hoz_dist.sim.generator.solids import Model, Rect, Top, box, vary


def chair(rng: Random) -> Model:
    """A chair with four legs, a seat and a back; it looks away from its back."""
    width, depth, height = vary(rng, 470, 12), vary(rng, 530, 10), vary(rng, 880, 10)
    wood = paint(rng, "chair")
    seat = paint(rng, "fabric") if rng.random() < 0.4 else wood
    half, leg, seat_height = width // 2, 40, vary(rng, 450, 5)
    legs = [
        box((x, x + leg), (z, z + leg), (0, seat_height - 40), shade(wood, 80))
        for x in (-half, half - leg)
        for z in (0, depth - leg)
    ]
    if rng.random() < 0.5:
        back = [box((-half, half), (0, 40), (seat_height, height), wood)]
    else:
        posts = [box((x, x + leg), (0, 40), (seat_height, height), wood) for x in (-half, half - leg)]
        rails = [box((-half + leg, half - leg), (5, 35), (h, h + 90), wood) for h in (height - 100, height - 270)]
        back = [*posts, *rails]
    return Model.of("Chair", [*legs, box((-half, half), (0, depth), (seat_height - 40, seat_height), seat), *back])


def stool(rng: Random) -> Model:
    """A bar stool."""
    width, height = vary(rng, 340, 8), vary(rng, 660, 6)
    colour = paint(rng, "black") if rng.random() < 0.5 else paint(rng, "wood")
    half = width // 2
    return Model.of(
        "Stool",
        [
            box((-half, half), (0, width), (height - 50, height), colour),
            box((-25, 25), (half - 25, half + 25), (30, height - 50), paint(rng, "steel")),
            box((-half + 40, half - 40), (40, width - 40), (0, 30), paint(rng, "steel")),
        ],
    )


def sofa(rng: Random) -> Model:
    """A sofa with arms, back and cushions; things can lie on the seat."""
    return _upholstered("Sofa", rng, vary(rng, 2300, 12), vary(rng, 920, 6), seats=rng.choice((2, 3)))


def arm_chair(rng: Random) -> Model:
    """A sofa for one."""
    return _upholstered("ArmChair", rng, vary(rng, 880, 8), vary(rng, 860, 6), seats=1)


def love_seat(rng: Random) -> Model:
    """A sofa for two."""
    return _upholstered("Sofa", rng, vary(rng, 1500, 8), vary(rng, 880, 6), seats=2)


def bench(rng: Random, width: int) -> Model:
    """An upholstered bench, for the end of a bed."""
    half, depth, height = width // 2, vary(rng, 400, 10), vary(rng, 440, 8)
    wood = paint(rng, "wood")
    return Model.of(
        "Bench",
        [
            box((-half, half), (0, depth), (height - 110, height), paint(rng, "fabric")),
            box((-half + 40, -half + 100), (30, depth - 30), (0, height - 110), wood),
            box((half - 100, half - 40), (30, depth - 30), (0, height - 110), wood),
        ],
    )


def ottoman(rng: Random) -> Model:
    """A footstool that stands anywhere on the floor."""
    width, height = vary(rng, 560, 25), vary(rng, 400, 12)
    half, colour = width // 2, paint(rng, "fabric")
    return Model.of(
        "Ottoman",
        [
            box((-half + 40, half - 40), (40, width - 40), (0, 60), (0.12, 0.1, 0.09)),
            box((-half, half), (0, width), (60, height - 100), shade(colour, 85)),
            box((-half, half), (0, width), (height - 100, height), colour),
        ],
    )


def _upholstered(category: str, rng: Random, width: int, depth: int, seats: int) -> Model:
    colour = paint(rng, "fabric")
    height, arm, back, seat = vary(rng, 860, 8), vary(rng, 180, 10), vary(rng, 220, 8), vary(rng, 430, 5)
    half = width // 2
    inner = (-half + arm, half - arm)
    span = (inner[1] - inner[0]) // seats
    cushions = [
        box(
            (inner[0] + i * span + 5, inner[0] + (i + 1) * span - 5),
            (back, depth - 10),
            (seat - 110, seat),
            shade(colour, 112),
        )
        for i in range(seats)
    ]
    solids = [
        box(inner, (back, depth - 20), (60, seat - 110), shade(colour, 85)),
        box((-half, half), (0, back), (60, height), colour),
        box((-half, inner[0]), (back, depth), (60, seat + 190), colour),
        box((inner[1], half), (back, depth), (60, seat + 190), colour),
        box((-half + 60, half - 60), (60, depth - 80), (0, 60), (0.12, 0.1, 0.09)),
        *cushions,
    ]
    return Model.of(category, solids, Top(Rect(inner[0] + 20, back + 20, inner[1] - 20, depth - 40), seat))


def bed(rng: Random, width: int) -> Model:
    """A bed, its head at the wall; things can lie on the lower half."""
    width, length, top = vary(rng, width, 8), vary(rng, 2180, 4), vary(rng, 560, 8)
    wood, cover = paint(rng, "wood"), paint(rng, "bedding")
    half = width // 2
    pillows = [(-half + 60, -20), (20, half - 60)] if width > 1200 else [(-300, 300)]
    solids = [
        box((-half, half), (0, 70), (0, vary(rng, 1000, 12)), wood),
        box((-half, half), (70, length), (90, 300), wood),
        box((-half + 60, half - 60), (120, length - 60), (0, 90), shade(wood, 60)),
        box((-half + 20, half - 20), (70, 620), (300, top - 20), paint(rng, "white")),
        box((-half + 10, half - 10), (620, length - 10), (300, top), cover),
        *(box(x, (100, 440), (top - 20, top + 90), shade(cover, 115)) for x in pillows),
    ]
    return Model.of("Bed", solids, Top(Rect(-half + 100, 800, half - 100, length - 100), top))
