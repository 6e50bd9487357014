"""Things that stand or lie on furniture or the floor."""

from random import Random
from typing import Final

from hoz_dist.sim.generator.palette import Colour, paint, shade
from hoz_dist.sim.generator.solids import Model, box, cylinder, vary

_DARK: Final[Colour] = (0.1, 0.1, 0.1)


def kettle(rng: Random) -> Model:
    """A kettle with lid, handle and spout."""
    width, height = vary(rng, 180, 10), vary(rng, 195, 12)
    half, colour = width // 2, paint(rng, "kettle")
    return Model.of(
        "Kettle",
        [
            box((-half, half), (0, width), (0, height * 3 // 4), colour),
            box((-half + 25, half - 25), (25, width - 25), (height * 3 // 4, height), shade(colour, 70)),
            box((-half - 40, -half), (half - 12, half + 12), (height // 4, height * 2 // 3), _DARK),
            box((half, half + 35), (half - 18, half + 18), (height // 2, height * 3 // 4), colour),
        ],
    )


def pot(rng: Random) -> Model:
    """A cooking pot with two handles and a lid."""
    width, height = vary(rng, 230, 12), vary(rng, 150, 12)
    half, colour = width // 2, paint(rng, "pot")
    return Model.of(
        "Pot",
        [
            cylinder(0, half, width, (0, height), colour),
            box((-half - 35, -half + 10), (half - 30, half + 30), (height - 45, height - 25), _DARK),
            box((half - 10, half + 35), (half - 30, half + 30), (height - 45, height - 25), _DARK),
            box((-20, 20), (half - 20, half + 20), (height, height + 25), _DARK),
        ],
    )


def pan(rng: Random) -> Model:
    """A frying pan; its handle points to the front."""
    width = vary(rng, 260, 10)
    half, colour = width // 2, paint(rng, "pan")
    rim, wall = 50, 16
    return Model.of(
        "Pan",
        [
            box((-half, half), (0, width), (0, 12), colour),
            box((-half, half), (0, wall), (12, rim), shade(colour, 150)),
            box((-half, half), (width - wall, width), (12, rim), shade(colour, 150)),
            box((-half, -half + wall), (wall, width - wall), (12, rim), shade(colour, 150)),
            box((half - wall, half), (wall, width - wall), (12, rim), shade(colour, 150)),
            box((-14, 14), (width, width + vary(rng, 160, 10)), (rim - 25, rim - 5), shade(colour, 130)),
        ],
    )


def plate(rng: Random) -> Model:
    """A plate: a foot and a wider rim."""
    width = vary(rng, 240, 12)
    half, colour = width // 2, paint(rng, "plate")
    return Model.of(
        "Plate",
        [
            cylinder(0, half, width * 3 // 5, (0, 10), shade(colour, 85)),
            cylinder(0, half, width, (10, 22), colour),
        ],
    )


def bowl(rng: Random) -> Model:
    """A bowl: a foot, sides that open upwards and a hollow."""
    width, height = vary(rng, 200, 12), vary(rng, 90, 12)
    half, colour = width // 2, paint(rng, "bowl")
    wall, foot = 18, height // 3
    inner = shade(colour, 75)
    return Model.of(
        "Bowl",
        [
            box((-half + 35, half - 35), (35, width - 35), (0, foot), inner),
            box((-half, half), (0, wall), (foot, height), colour),
            box((-half, half), (width - wall, width), (foot, height), colour),
            box((-half, -half + wall), (wall, width - wall), (foot, height), colour),
            box((half - wall, half), (wall, width - wall), (foot, height), colour),
            box((-half + wall, half - wall), (wall, width - wall), (foot, foot + 12), inner),
        ],
    )


def book(rng: Random) -> Model:
    """A closed book lying flat: covers and pages."""
    width, depth, height = vary(rng, 200, 15), vary(rng, 265, 12), vary(rng, 36, 20)
    half, colour = width // 2, paint(rng, "book")
    return Model.of(
        "Book",
        [
            box((-half, half), (0, depth), (0, 8), colour),
            box((-half + 10, half - 8), (8, depth - 8), (8, height - 8), (0.92, 0.89, 0.80)),
            box((-half, half), (0, depth), (height - 8, height), colour),
        ],
    )


def cell_phone(rng: Random) -> Model:
    """A phone lying on its back."""
    width, depth = vary(rng, 80, 8), vary(rng, 152, 8)
    half = width // 2
    body = box((-half, half), (0, depth), (0, 10), paint(rng, "phone"))
    screen = box((-half + 6, half - 6), (10, depth - 10), (10, 12), paint(rng, "dark_screen"))
    return Model.of("CellPhone", [body, screen])


def remote_control(rng: Random) -> Model:
    """A remote control with a field of buttons."""
    width, depth = vary(rng, 64, 10), vary(rng, 212, 10)
    half, colour = width // 2, paint(rng, "remote")
    body = box((-half, half), (0, depth), (0, 20), colour)
    keys = box((-half + 12, half - 12), (40, depth - 20), (20, 24), (0.62, 0.62, 0.64))
    power = box((-10, 10), (14, 32), (20, 24), (0.8, 0.15, 0.12))
    return Model.of("RemoteControl", [body, keys, power])


def laptop(rng: Random) -> Model:
    """An open laptop; its keys are at the front."""
    width, depth, height = vary(rng, 380, 10), vary(rng, 270, 8), vary(rng, 270, 10)
    half, colour = width // 2, paint(rng, "laptop")
    return Model.of(
        "Laptop",
        [
            box((-half, half), (0, depth), (0, 18), colour),
            box((-half + 20, half - 20), (40, depth - 110), (18, 22), _DARK),
            box((-half, half), (0, 14), (18, height), colour),
            box((-half + 12, half - 12), (14, 18), (34, height - 12), paint(rng, "screen")),
        ],
    )


def alarm_clock(rng: Random) -> Model:
    """An alarm clock with a white face and two bells."""
    width, depth, height = vary(rng, 180, 15), vary(rng, 90, 12), vary(rng, 170, 12)
    half, colour = width // 2, paint(rng, "alarm_clock")
    body = height * 4 // 5
    return Model.of(
        "AlarmClock",
        [
            box((-half, half), (0, depth), (0, body), colour),
            box((-half + 18, half - 18), (depth, depth + 5), (18, body - 18), (0.96, 0.96, 0.90)),
            box((-4, 4), (depth + 5, depth + 8), (body // 2, body - 30), _DARK),
            box((-half + 10, -10), (20, depth - 20), (body, height), shade(colour, 70)),
            box((10, half - 10), (20, depth - 20), (body, height), shade(colour, 70)),
        ],
    )


def television(rng: Random, width: int, *, on_wall: bool) -> Model:
    """A flat television, on a foot or for the wall."""
    width = vary(rng, width, 15)
    height = width * rng.randint(56, 66) // 100
    half, colour = width // 2, paint(rng, "black")
    screen = paint(rng, rng.choice(("dark_screen", "dark_screen", "screen")))
    if on_wall:
        return Model.of(
            "Television",
            [
                box((-half, half), (0, 36), (0, height), colour),
                box((-half + 25, half - 25), (36, 40), (30, height - 25), screen),
            ],
        )
    return Model.of(
        "Television",
        [
            box((-half // 2, half // 2), (0, 240), (0, 20), colour),
            box((-60, 60), (100, 140), (20, 90), colour),
            box((-half, half), (95, 145), (90, height + 90), colour),
            box((-half + 25, half - 25), (145, 149), (120, height + 65), screen),
        ],
    )


def desk_lamp(rng: Random) -> Model:
    """A table lamp: foot, stem and shade."""
    height, width = vary(rng, 460, 15), vary(rng, 250, 12)
    half, stem = width // 2, paint(rng, "steel")
    return Model.of(
        "DeskLamp",
        [
            box((-80, 80), (half - 80, half + 80), (0, 25), stem),
            box((-14, 14), (half - 14, half + 14), (25, height * 3 // 5), stem),
            cylinder(0, half, width, (height * 3 // 5, height), paint(rng, "shade")),
        ],
    )


def floor_lamp(rng: Random) -> Model:
    """A standing lamp: foot, pole and shade."""
    height, width = vary(rng, 1840, 6), vary(rng, 490, 12)
    half, pole = width // 2, paint(rng, rng.choice(("black", "steel")))
    return Model.of(
        "FloorLamp",
        [
            box((-150, 150), (half - 150, half + 150), (0, 30), pole),
            box((-18, 18), (half - 18, half + 18), (30, height - 380), pole),
            cylinder(0, half, width, (height - 380, height), paint(rng, "shade")),
        ],
    )


def garbage_can(rng: Random) -> Model:
    """A bin: an open one, or one with a lid and a pedal."""
    width, depth, height = vary(rng, 410, 15), vary(rng, 350, 12), vary(rng, 550, 15)
    half, colour = width // 2, paint(rng, "bin")
    if rng.random() < 0.5:
        wall = 20
        return Model.of(
            "GarbageCan",
            [
                box((-half, half), (0, depth), (0, 20), colour),
                box((-half, half), (0, wall), (20, height), colour),
                box((-half, half), (depth - wall, depth), (20, height), colour),
                box((-half, -half + wall), (wall, depth - wall), (20, height), colour),
                box((half - wall, half), (wall, depth - wall), (20, height), colour),
                box((-half + wall, half - wall), (wall, depth - wall), (height - 120, height - 90), (0.88, 0.88, 0.86)),
            ],
        )
    return Model.of(
        "GarbageCan",
        [
            box((-half, half), (0, depth - 20), (0, height - 60), colour),
            box((-half - 10, half + 10), (0, depth - 10), (height - 60, height), shade(colour, 150)),
            box((-50, 50), (depth - 20, depth + 20), (20, 45), _DARK),
        ],
    )


def plant(rng: Random) -> Model:
    """A plant in a pot, for the floor."""
    width, height = vary(rng, 420, 20), vary(rng, 1000, 25)
    half, leaves = width // 2, paint(rng, "plant")
    return Model.of(
        "Plant",
        [
            box((-140, 140), (half - 140, half + 140), (0, 300), paint(rng, "bin")),
            box((-20, 20), (half - 20, half + 20), (300, height // 2), (0.36, 0.26, 0.16)),
            box((-half, half), (60, width - 60), (height // 2, height * 5 // 6), leaves),
            box((-half + 60, half - 60), (0, width), (height * 3 // 5, height), shade(leaves, 85)),
        ],
    )
