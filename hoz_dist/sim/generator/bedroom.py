"""Bedrooms: a bed with its tables, a desk, cupboards, and what lies around."""

from hoz_dist.sim.generator import seating, small_things, tables
from hoz_dist.sim.generator.dining import workplace
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.shell import entrance, free_rug, pictures, windows
from hoz_dist.sim.generator.solids import Placed, Rect, Spot


def furnish(plan: FloorPlan) -> None:
    """Furnish a bedroom."""
    rng = plan.rng
    entrance(plan, tuple(plan.any_walls()))
    place_bed(plan)
    if rng.random() < 0.9:
        workplace(plan)
    for make, chance in (
        (tables.wardrobe, 90),
        (tables.dresser, 88),
        (seating.arm_chair, 60),
        (tables.shelf, 60),
        (tables.dresser, 25),
    ):
        if rng.randrange(100) < chance:
            plan.against_wall(make(rng), plan.any_walls(), access=450)
    if not plan.has("Chair") and rng.random() < 0.8:
        plan.against_wall(seating.chair(rng), plan.any_walls(), access=400)
    if rng.random() < 0.3:
        plan.against_wall(small_things.floor_lamp(rng), plan.any_walls(), access=300)
    plan.against_wall(small_things.garbage_can(rng), plan.any_walls(), access=300)
    if rng.random() < 0.4:
        plan.on_floor(seating.ottoman(rng), 500)
    windows(plan, rng.randint(1, 2), curtains=rng.random() < 0.8)
    _small_things(plan)
    pictures(plan, rng.randint(0, 3))
    for _ in range(rng.randint(0, 2)):
        plan.against_wall(small_things.plant(rng), plan.any_walls())
    if rng.random() < 0.6:
        free_rug(plan, 1700, 1100)


def place_bed(plan: FloorPlan) -> None:
    """Place the bed, its head at a wall, with a table on one side or both."""
    rng = plan.rng
    model = seating.bed(rng, rng.choice((1000, 1400, 1500, 1600, 1700)))
    for wall in plan.any_walls():
        length = plan.wall_length(wall)
        room = model.width // 2
        for _ in range(12):
            along = rng.randint(room + 10, length - room - 10) // 2 * 2
            spot = plan.wall_spot(wall, along)
            left = along - room
            right = length - along - room
            sides = [sign for sign, free in ((-1, left), (1, right)) if free >= 1150]
            # A gap too narrow to walk in looks odd and is a pocket.
            if any(30 < free < 600 for free in (left, right)) or not sides or not plan.fits(model, spot, 20):
                continue
            bed = plan.add(model, spot)
            rng.shuffle(sides)
            for index, sign in enumerate(sides):
                if index == 0 or rng.random() < 0.7:
                    _bedside(plan, bed, sign)
            if rng.random() < 0.4:
                bench = seating.bench(rng, model.width * 3 // 4 // 2 * 2)
                x, z = spot.point(0, model.depth + 40)
                plan.at(bench, Spot(x, z, 0, wall))
            rect = model.rect
            plan.keep_free(
                spot.rect(Rect(rect.x0 - 700 * (-1 in sides), 450, rect.x1 + 700 * (1 in sides), rect.z1 + 650))
            )
            return


def _bedside(plan: FloorPlan, bed: Placed, sign: int) -> None:
    model = tables.side_table(plan.rng)
    x, z = bed.spot.point(sign * (bed.model.width // 2 + model.width // 2 + 40), 0)
    spot = Spot(x, z, 0, bed.spot.quarter)
    if plan.fits(model, spot, 10):
        plan.add(model, spot)


def _small_things(plan: FloorPlan) -> None:
    """Put things where they are used (shares of receptacles after the field's statistics)."""
    rng = plan.rng
    if rng.random() < 0.35:
        plan.put(small_things.television(rng, 800, on_wall=False), {"Dresser": 100})
    for make, chance, places, turn in (
        (small_things.alarm_clock, 92, {"SideTable": 68, "Dresser": 14, "Desk": 18}, False),
        (small_things.desk_lamp, 92, {"SideTable": 55, "Desk": 28, "Dresser": 17}, False),
        (small_things.laptop, 90, {"Desk": 65, "Bed": 20, "Dresser": 15}, False),
        (small_things.book, 92, {"Desk": 35, "SideTable": 15, "Bed": 25, "Shelf": 15, "Dresser": 10}, True),
        (small_things.bowl, 75, {"Desk": 35, "Dresser": 40, "Shelf": 15, "SideTable": 10}, False),
        (small_things.cell_phone, 80, {"Desk": 35, "SideTable": 30, "Bed": 20, "Dresser": 15}, True),
        (small_things.book, 40, {"Shelf": 50, "Desk": 30, "Dresser": 20}, True),
        (small_things.remote_control, 25, {"SideTable": 40, "Bed": 30, "Dresser": 30}, True),
    ):
        if rng.randrange(100) < chance:
            plan.put(make(rng), places, turn=turn)
