"""Chairs at tables and desks."""

from hoz_dist.sim.generator import tables
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.seating import chair
from hoz_dist.sim.generator.solids import Placed, Spot


def dining_set(plan: FloorPlan, chairs: int) -> Placed | None:
    """Place a dining table with chairs, in the room or at a wall, smaller where the room is small.

    Args:
        plan: The room.
        chairs: How many chairs to try to place.
    """
    rng = plan.rng
    free_standing = rng.random() < 0.6
    for percent in (100, 90, 80, 70, 60):
        model = tables.dining_table(rng, percent)
        table = plan.on_floor(model, 700) if free_standing else None
        table = table or plan.against_wall(model, plan.any_walls(), access=700, margin=600)
        if table:
            chairs_at(plan, table, chairs)
            return table
    return None


def workplace(plan: FloorPlan) -> Placed | None:
    """Place a desk with a chair."""
    rng = plan.rng
    desk = plan.against_wall(tables.desk(rng), plan.any_walls(), access=900)
    if desk:
        chairs_at(plan, desk, 1, front_only=True)
    return desk


def chairs_at(plan: FloorPlan, table: Placed, count: int, *, front_only: bool = False) -> None:
    """Place equal chairs around a table or in front of a desk, looking at it.

    Args:
        plan: The room.
        table: The table.
        count: How many chairs; fewer where there is no room.
        front_only: Whether only the table's front has room for knees.
    """
    rng = plan.rng
    model = chair(rng)
    area = table.model.rect
    middle = (area.z0 + area.z1) // 2
    long_side = [area.x0 // 2, area.x1 // 2] if area.x1 - area.x0 > 1150 else [0]
    sides = [*((side, x) for side in (2, 0) for x in long_side), (1, middle), (3, middle)]
    if front_only:
        sides = [(2, x) for x in range(area.x0 + 250, area.x1 - 240, 50)]
    rng.shuffle(sides)
    placed = 0
    for side, along in sides:
        if placed == count:
            return
        for tucked in sorted(rng.sample(range(40, 340), 3)):
            spot = _seat_spot(table, side, along, model.depth - tucked)
            if plan.fits(model, spot, 5, on_ways=True):
                plan.add(model, spot)
                placed += 1
                break


def _seat_spot(table: Placed, side: int, along: int, out: int) -> Spot:
    """Return where a chair at a side of a table stands, so that its back is `out` away from the edge."""
    area = table.model.rect
    x, z = {
        0: (along, area.z0 - out),
        1: (area.x0 - out, along),
        2: (along, area.z1 + out),
        3: (area.x1 + out, along),
    }[side]
    return Spot(*table.spot.point(x, z), 0, (table.spot.quarter + side) % 4)
