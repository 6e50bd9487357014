"""What only bathrooms have."""

from random import Random
from typing import Final

from hoz_dist.sim.generator.palette import Colour, paint, shade
from hoz_dist.sim.generator.solids import Model, Rect, Top, box, vary

_DARK: Final[Colour] = (0.1, 0.1, 0.1)


def toilet(rng: Random) -> Model:
    """A toilet: foot, bowl with a hollow, tank and raised lid."""
    width, depth = vary(rng, 400, 10), vary(rng, 680, 8)
    half, colour, tank = width // 2, paint(rng, "ceramic"), 190
    return Model.of(
        "Toilet",
        [
            box((-110, 110), (tank, depth - 140), (0, 220), shade(colour, 92)),
            box((-half + 20, half - 20), (tank, depth), (220, 390), colour),
            box((-half + 90, half - 90), (tank + 90, depth - 80), (390, 396), (0.35, 0.42, 0.46)),
            box((-half, half), (0, tank), (380, 800), colour),
            box((-half + 20, half - 20), (tank, tank + 40), (400, 790), shade(colour, 88)),
            box((-30, 30), (60, 120), (800, 812), paint(rng, "steel")),
        ],
    )


def bathtub(rng: Random) -> Model:
    """A bathtub with a hollow, some water and a tap; its back is a long side."""
    width, depth, height = vary(rng, 1600, 8), vary(rng, 740, 6), vary(rng, 560, 8)
    half, colour, rim = width // 2, paint(rng, "ceramic"), 70
    x, z = (-half + rim, half - rim), (rim, depth - rim)
    return Model.of(
        "Bathtub",
        [
            box((-half, half), (0, depth), (0, 160), shade(colour, 90)),
            box((-half, half), (0, rim), (160, height), colour),
            box((-half, half), (depth - rim, depth), (160, height), colour),
            box((-half, x[0]), z, (160, height), colour),
            box((x[1], half), z, (160, height), colour),
            box(x, z, (160, height // 2), paint(rng, "water")),
            box(
                (-half + 20, -half + 50),
                (depth // 2 - 20, depth // 2 + 20),
                (height, height + 160),
                paint(rng, "steel"),
            ),
            box(
                (-half + 50, -half + 170),
                (depth // 2 - 15, depth // 2 + 15),
                (height + 125, height + 155),
                paint(rng, "steel"),
            ),
        ],
    )


def shower(rng: Random) -> Model:
    """A shower: tray, a screen of frosted glass on one side, pipe and head."""
    width = vary(rng, 920, 8)
    half, steel, glass = width // 2, paint(rng, "steel"), paint(rng, "pane")
    side = -half if rng.random() < 0.5 else half - 20
    return Model.of(
        "Shower",
        [
            box((-half, half), (0, width), (0, 120), paint(rng, "ceramic")),
            box((-half + 60, half - 60), (60, width - 60), (120, 124), (0.72, 0.74, 0.75)),
            box((side, side + 20), (0, width), (124, 2000), glass),
            box((-15, 15), (20, 50), (900, 2050), steel),
            box((-90, 90), (50, 230), (2020, 2050), steel),
            box((-60, 60), (10, 60), (1050, 1110), steel),
        ],
    )


def pedestal_sink(rng: Random) -> Model:
    """A wash-basin on a pedestal, with a tap."""
    width, depth, height = vary(rng, 580, 10), vary(rng, 460, 8), vary(rng, 850, 5)
    half, colour, tap = width // 2, paint(rng, "ceramic"), paint(rng, "steel")
    low, wall = height - 170, 40
    return Model.of(
        "Sink",
        [
            box((-90, 90), (40, 220), (0, low), shade(colour, 92)),
            box((-half, half), (0, depth), (low, low + 30), shade(colour, 80)),
            box((-half, half), (0, 110), (low + 30, height), colour),
            box((-half, half), (depth - wall, depth), (low + 30, height), colour),
            box((-half, -half + wall), (110, depth - wall), (low + 30, height), colour),
            box((half - wall, half), (110, depth - wall), (low + 30, height), colour),
            box((-25, 25), (depth // 2, depth // 2 + 50), (low + 30, low + 34), _DARK),
            box((-18, 18), (30, 66), (height, height + 200), tap),
            box((-14, 14), (66, 200), (height + 165, height + 195), tap),
        ],
    )


def towel_rail(rng: Random) -> Model:
    """A rail with a towel, for the wall."""
    half, steel = vary(rng, 500) // 2, paint(rng, "steel")
    width = rng.randint(50, 85) * half // 100
    return Model.of(
        "Towel",
        [
            box((-half, half), (20, 32), (580, 592), steel),
            box((-half, -half + 15), (0, 20), (575, 597), steel),
            box((half - 15, half), (0, 20), (575, 597), steel),
            box((-width, width), (32, 44), (0, 600), paint(rng, "towel")),
        ],
    )


def bathroom_shelf(rng: Random) -> Model:
    """A narrow cupboard."""
    width, depth, height = vary(rng, 420, 12), vary(rng, 320, 8), vary(rng, 1100, 25)
    half, colour = width // 2, paint(rng, "cabinet")
    return Model.of(
        "Shelf",
        [
            box((-half, half), (0, depth - 20), (0, height), colour),
            box((-half + 15, half - 15), (depth - 20, depth), (60, height // 2 - 8), shade(colour, 88)),
            box((-half + 15, half - 15), (depth - 20, depth), (height // 2 + 8, height - 20), shade(colour, 88)),
        ],
        Top(Rect(-half + 20, 20, half - 20, depth - 30), height),
    )


def hamper(rng: Random) -> Model:
    """A basket for laundry."""
    half, depth, height = vary(rng, 440) // 2, vary(rng, 360), vary(rng, 600)
    colour = paint(rng, "wood")
    return Model.of(
        "LaundryHamper",
        [
            box((-half, half), (0, depth), (0, height - 50), colour),
            box((-half - 10, half + 10), (0, depth + 10), (height - 50, height), shade(colour, 80)),
        ],
    )


def toilet_roll(rng: Random) -> Model:
    """A roll on a holder, for the wall."""
    return Model.of(
        "ToiletPaper",
        [
            box((-70, 70), (0, 10), (0, 60), paint(rng, "steel")),
            box((-55, 55), (10, 110), (-30, 70), paint(rng, "white")),
        ],
    )
