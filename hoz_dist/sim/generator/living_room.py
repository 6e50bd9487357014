"""Living rooms: a television opposite a sofa, places to eat or work, and what lies around."""

from typing import Final

from hoz_dist.sim.generator import seating, small_things, tables
from hoz_dist.sim.generator.dining import dining_set, workplace
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.shell import entrance, free_rug, pictures, rug, windows
from hoz_dist.sim.generator.solids import Placed, Rect, Spot, vary

_WAY: Final = 750
"""Free floor in front of furniture."""
_RUG_HEIGHT: Final = 10


def furnish(plan: FloorPlan) -> None:
    """Furnish a living room."""
    rng = plan.rng
    entrance(plan, tuple(plan.any_walls()))
    television_corner(plan)
    if rng.random() < 0.92:
        dining_set(plan, rng.choice((2, 3, 4, 4, 5)))
    if rng.random() < 0.5 or not plan.has("Chair"):
        workplace(plan)
    for make, chance in (
        (tables.shelf, 75),
        (tables.dresser, 80),
        (seating.arm_chair, 55),
        (tables.side_table, 80),
        (tables.shelf, 40),
    ):
        if rng.randrange(100) < chance:
            plan.against_wall(make(rng), plan.any_walls(), access=450)
    if rng.randrange(100) < 92:
        plan.against_wall(small_things.floor_lamp(rng), plan.any_walls(), access=200)
    plan.against_wall(small_things.garbage_can(rng), plan.any_walls(), access=300)
    for _ in range(rng.randint(1, 3)):
        plan.against_wall(small_things.plant(rng), plan.any_walls())
    if rng.random() < 0.35:
        plan.on_floor(seating.ottoman(rng), 500)
    windows(plan, rng.randint(1, 3), curtains=rng.random() < 0.7)
    pictures(plan, rng.randint(1, 3))
    _small_things(plan)
    if rng.random() < 0.5:
        free_rug(plan, 1600, 1000)


def television_corner(plan: FloorPlan) -> None:
    """Place television, sofa and coffee table in one axis, then what stands beside the sofa."""
    rng = plan.rng
    stand, couch = tables.tv_stand(rng), seating.sofa(rng)
    for wall in plan.any_walls():
        across = plan.wall_length((wall + 1) % 4)
        if across < 3600:
            continue
        length = plan.wall_length(wall)
        edge = max(stand.width, couch.width) // 2 + 50
        for _ in range(12):
            along = rng.randint(edge, max(edge, length - edge)) // 2 * 2
            stand_spot = plan.wall_spot(wall, along)
            # Either at the opposite wall, or in the room with a way behind the sofa.
            distance = min(across, rng.randrange(3400, 4400, 50))
            if across - distance < 900:
                distance = across
            x, z = stand_spot.point(0, distance)
            couch_spot = Spot(x, z, 0, (wall + 2) % 4)
            if distance > 5200 or not (plan.fits(stand, stand_spot) and plan.fits(couch, couch_spot)):
                continue
            tv_stand, sofa = plan.add(stand, stand_spot), plan.add(couch, couch_spot)
            place_television(plan, tv_stand)
            _between(plan, tv_stand, sofa)
            _beside(plan, sofa)
            return


def place_television(plan: FloorPlan, stand: Placed) -> None:
    """Put the television on its stand or hang it above."""
    rng = plan.rng
    if rng.random() < 0.95:
        on_wall = rng.random() < 0.35
        model = small_things.television(rng, 1140, on_wall=on_wall)
        height = rng.randint(950, 1100) if on_wall else stand.model.height
        plan.at(model, stand.spot._replace(height=height), margin=0)
    front = stand.model.rect
    plan.keep_free(stand.spot.rect(Rect(front.x0, front.z1, front.x1, front.z1 + _WAY)))


def _between(plan: FloorPlan, stand: Placed, sofa: Placed) -> None:
    """Place the coffee table, mostly on a rug, in front of the sofa."""
    rng = plan.rng
    table = tables.coffee_table(rng)
    out = sofa.model.depth + rng.randint(320, 450)
    height = 0
    if rng.random() < 0.7:
        mat = rug(rng, vary(rng, 2000), table.depth + 2 * rng.randint(200, 290))
        x, z = sofa.spot.point(0, out + (table.depth - mat.depth) // 2)
        spot = Spot(x, z, 0, sofa.spot.quarter)
        if plan.fits(mat, spot, on_ways=True):
            plan.add(mat, spot)
            height = _RUG_HEIGHT
    x, z = sofa.spot.point(0, out)
    spot = Spot(x, z, height, sofa.spot.quarter)
    gap = _distance_between(stand, spot)
    if gap - table.depth >= 700 and plan.fits(table, spot):
        plan.add(table, spot)
        _across(plan, sofa, out + table.depth // 2, table.width // 2 + rng.randint(450, 600))
    width = sofa.model.rect
    plan.keep_free(sofa.spot.rect(Rect(width.x0, sofa.model.depth, width.x1, sofa.model.depth + 300)))


def _across(plan: FloorPlan, sofa: Placed, ahead: int, aside: int) -> None:
    """Place an armchair or a short sofa at one end of the coffee table or both, looking at it.

    Args:
        plan: The room.
        sofa: The sofa in front of the table.
        ahead: Distance of the table's middle from the sofa's back.
        aside: Distance of the seats' fronts from the table's middle.
    """
    rng = plan.rng
    for side in (-1, 1):
        if rng.random() < 0.55:
            model = seating.arm_chair(rng) if rng.random() < 0.75 else seating.love_seat(rng)
            x, z = sofa.spot.point(side * (aside + model.depth), ahead)
            spot = Spot(x, z, 0, (sofa.spot.quarter - side) % 4)
            if plan.fits(model, spot, 100):
                plan.add(model, spot)


def _distance_between(stand: Placed, spot: Spot) -> int:
    """Return the free length between a stand's front and a spot in its axis."""
    front_x, front_z = stand.spot.point(0, stand.model.depth)
    return abs(spot.x - front_x) + abs(spot.z - front_z)


def _beside(plan: FloorPlan, sofa: Placed) -> None:
    """Place side table and floor lamp at the ends of the sofa."""
    rng = plan.rng
    makers = [tables.side_table, small_things.floor_lamp]
    rng.shuffle(makers)
    for side, make in zip((-1, 1), makers, strict=True):
        model = make(rng)
        x, z = sofa.spot.point(side * (sofa.model.width // 2 + model.width // 2 + 60), 30)
        spot = Spot(x, z, 0, sofa.spot.quarter)
        if rng.random() < 0.75 and plan.fits(model, spot, 10):
            plan.add(model, spot)


def _small_things(plan: FloorPlan) -> None:
    """Put things where they are used (shares of receptacles after the field's statistics)."""
    rng = plan.rng
    for make, chance, places, turn in (
        (small_things.laptop, 88, {"CoffeeTable": 30, "Desk": 30, "DiningTable": 25, "Sofa": 15}, False),
        (small_things.desk_lamp, 88, {"SideTable": 55, "Desk": 22, "Dresser": 23}, False),
        (small_things.remote_control, 92, {"CoffeeTable": 40, "SideTable": 20, "Sofa": 20, "TVStand": 20}, True),
        (small_things.book, 92, {"CoffeeTable": 35, "Shelf": 20, "Desk": 20, "SideTable": 10, "Sofa": 15}, True),
        (small_things.plate, 80, {"DiningTable": 60, "CoffeeTable": 40}, False),
        (small_things.bowl, 40, {"DiningTable": 50, "CoffeeTable": 30, "Dresser": 20}, False),
        (small_things.cell_phone, 40, {"Desk": 30, "SideTable": 30, "CoffeeTable": 40}, True),
        (small_things.book, 40, {"Shelf": 50, "Dresser": 30, "SideTable": 20}, True),
    ):
        if rng.randrange(100) < chance:
            plan.put(make(rng), places, turn=turn)
