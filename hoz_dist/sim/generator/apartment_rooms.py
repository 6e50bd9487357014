"""What stands in the rooms of an apartment; small things come later, see `hoz_dist.sim.generator.apartment`."""

from collections.abc import Callable
from typing import Final

from hoz_dist.sim.generator import bathroom, bathroom_fixtures, bedroom, living_room, seating, small_things, tables
from hoz_dist.sim.generator.appliances import CabinetStyle
from hoz_dist.sim.generator.dining import dining_set, workplace
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.kitchen import Run, fill_runs
from hoz_dist.sim.generator.palette import Colour
from hoz_dist.sim.generator.shell import entrance, free_rug, pictures, windows
from hoz_dist.sim.generator.solids import Model, box

_CORNER_TRIES: Final = 4
"""How often to look for a place for television and sofa: doorways leave few."""
_LEAST_RUN: Final = 1500
_MOST_RUN: Final = 3900
_SLICE: Final = 50
"""Width of the pieces by which a wall is searched for free stretches."""
_NO_COLOUR: Final[Colour] = (0.0, 0.0, 0.0)


def living(plan: FloorPlan) -> None:
    """Furnish a living room: the apartment's entrance, a television opposite a sofa, mostly a dining table."""
    rng = plan.rng
    entrance(plan, tuple(rng.sample(plan.outer, len(plan.outer))))
    for _ in range(_CORNER_TRIES):
        if not plan.has("TVStand"):
            living_room.television_corner(plan)
    if not plan.has("TVStand"):
        plan.against_wall(seating.love_seat(rng), plan.any_walls(), access=600)
        stand = plan.against_wall(tables.tv_stand(rng), plan.any_walls(), access=900)
        if stand:
            living_room.place_television(plan, stand)
    if rng.random() < 0.6:
        dining_set(plan, rng.choice((2, 2, 3, 4)))
    for make, chance in ((tables.shelf, 60), (tables.side_table, 45), (tables.dresser, 25), (seating.arm_chair, 25)):
        if rng.randrange(100) < chance:
            plan.against_wall(make(rng), plan.any_walls(), access=450)
    for _ in range(rng.randint(0, 2)):
        plan.against_wall(small_things.plant(rng), plan.any_walls())
    windows(plan, rng.randint(1, 2), curtains=rng.random() < 0.7)
    pictures(plan, rng.randint(1, 2))


def kitchen(plan: FloorPlan) -> None:
    """Furnish a kitchen: worktops where the doorways leave room for them, and mostly a table."""
    rng = plan.rng
    style = CabinetStyle.draw(rng)
    runs = _runs(plan, style)
    if runs:
        fill_runs(plan, style, runs)
    if rng.random() < 0.7:
        dining_set(plan, rng.choice((2, 2, 3, 4)))
    windows(plan, 1, curtains=rng.random() < 0.3)
    pictures(plan, rng.randint(0, 1))
    if rng.random() < 0.4:
        free_rug(plan, 1200, 700)


def bed_room(plan: FloorPlan) -> None:
    """Furnish a bedroom: a bed with its tables, cupboards, in some a desk."""
    rng = plan.rng
    bedroom.place_bed(plan)
    for make, chance in ((tables.wardrobe, 85), (tables.dresser, 70), (tables.shelf, 25), (seating.arm_chair, 20)):
        if rng.randrange(100) < chance:
            plan.against_wall(make(rng), plan.any_walls(), access=450)
    if rng.random() < 0.25:
        workplace(plan)
    windows(plan, 1, curtains=rng.random() < 0.8)
    pictures(plan, rng.randint(0, 2))
    if rng.random() < 0.5:
        free_rug(plan, 1500, 1000)


def study(plan: FloorPlan) -> None:
    """Furnish a study: a desk, shelves, a place to read, in some a couch for guests."""
    rng = plan.rng
    workplace(plan)
    for make, chance in (
        (seating.love_seat, 40),
        (tables.shelf, 85),
        (seating.arm_chair, 35),
        (tables.side_table, 40),
        (tables.dresser, 35),
    ):
        if rng.randrange(100) < chance:
            plan.against_wall(make(rng), plan.any_walls(), access=450)
    for _ in range(rng.randint(0, 1)):
        plan.against_wall(small_things.plant(rng), plan.any_walls())
    windows(plan, 1, curtains=rng.random() < 0.6)
    pictures(plan, rng.randint(0, 2))


def bath(plan: FloorPlan) -> None:
    """Furnish a bathroom."""
    rng = plan.rng
    bathroom.fixtures(plan)
    if rng.random() < 0.4:
        plan.against_wall(bathroom_fixtures.hamper(rng), plan.any_walls(), access=450)
    plan.against_wall(bathroom_fixtures.towel_rail(rng), plan.any_walls(), height=rng.randint(900, 1100))
    if rng.random() < 0.6:
        free_rug(plan, 700, 500)


FURNISH: Final[dict[str, Callable[[FloorPlan], None]]] = {
    "living": living,
    "kitchen": kitchen,
    "bedroom": bed_room,
    "study": study,
    "bath": bath,
}
"""By kind of room, see `hoz_dist.sim.generator.apartment_layout.KINDS`."""


def _runs(plan: FloorPlan, style: CabinetStyle) -> list[Run]:
    """Choose where the worktops go: the longest stretch of a wall, and another one around its corner where it is free.

    Returns:
        One run or two; none when no stretch is long enough.
    """
    rng = plan.rng
    free = [(wall, *span) for wall in plan.any_walls() for span in _free_stretches(plan, wall, style.depth)]
    corners = []
    for wall, start, end in free:
        # The wall at our right end is numbered one lower; its own left end is the shared corner.
        for other, begin, stop in free:
            meet = other == (wall - 1) % 4 and end == plan.wall_length(wall) and begin == 0
            if meet and min(stop - style.depth, end - start) >= _LEAST_RUN:
                corners.append(((wall, start, end), (other, begin, stop)))
    if corners and rng.random() < 0.8:
        (wall, start, end), (other, _, stop) = rng.choice(corners)
        reach = min(stop, style.depth + rng.randrange(_LEAST_RUN, _MOST_RUN, 50))
        return [Run(wall, max(start, end - _MOST_RUN), end, -1), Run(other, style.depth, reach, 1)]
    longest = max(free, key=lambda span: span[2] - span[1], default=None)
    if longest is None or longest[2] - longest[1] < _LEAST_RUN:
        return []
    wall, start, end = longest
    return [Run(wall, start, min(end, start + _MOST_RUN), rng.choice((-1, 1)))]


def _free_stretches(plan: FloorPlan, wall: int, depth: int) -> list[tuple[int, int]]:
    """Return from where to where worktops of a depth can stand along a wall, and tall things among them."""
    length, half = plan.wall_length(wall), _SLICE // 2
    probe = Model.of("Probe", [box((-half, half), (0, depth), (0, 2000), _NO_COLOUR)])
    stretches: list[tuple[int, int]] = []
    for along in range(half, length - half + 1, _SLICE):
        if not plan.fits(probe, plan.wall_spot(wall, along)):
            continue
        start, end = along - half, along + half
        end = length if length - end < _SLICE else end
        if stretches and stretches[-1][1] == start:
            start = stretches.pop()[0]
        stretches.append((start, end))
    return stretches
