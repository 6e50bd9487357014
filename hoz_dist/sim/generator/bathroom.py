"""Bathrooms: wash-basin under a mirror, toilet, bathtub or shower."""

from random import Random

from hoz_dist.sim.generator import appliances, bathroom_fixtures, small_things
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.palette import paint
from hoz_dist.sim.generator.shell import entrance, free_rug, pictures, windows
from hoz_dist.sim.generator.solids import Model, Spot, box


def furnish(plan: FloorPlan) -> None:
    """Furnish a bathroom."""
    rng = plan.rng
    entrance(plan, tuple(plan.any_walls()))
    fixtures(plan)
    plan.against_wall(small_things.garbage_can(rng), plan.any_walls(), access=250, margin=40)
    for make, chance in ((bathroom_fixtures.bathroom_shelf, 65), (bathroom_fixtures.hamper, 60)):
        if rng.randrange(100) < chance:
            plan.against_wall(make(rng), plan.any_walls(), access=450)
    windows(plan, rng.randint(0, 1), curtains=rng.random() < 0.2)
    for _ in range(rng.randint(1, 2)):
        plan.against_wall(bathroom_fixtures.towel_rail(rng), plan.any_walls(), height=rng.randint(900, 1100))
    if rng.random() < 0.8:
        plan.against_wall(bathroom_fixtures.toilet_roll(rng), plan.any_walls(), height=700)
    pictures(plan, rng.randint(0, 1))
    if rng.random() < 0.8:
        free_rug(plan, 800, 550)


def fixtures(plan: FloorPlan) -> None:
    """Place bathtub or shower or both, wash-basin and toilet."""
    rng = plan.rng
    bathing = rng.choices(("tub", "shower", "both"), (50, 32, 18))[0]
    if bathing in {"tub", "both"}:
        plan.against_wall(bathroom_fixtures.bathtub(rng), plan.any_walls(), access=600, margin=10)
    _washing_place(plan)
    plan.against_wall(bathroom_fixtures.toilet(rng), plan.any_walls(), access=550, margin=150)
    if bathing in {"shower", "both"}:
        plan.against_wall(bathroom_fixtures.shower(rng), plan.any_walls(), access=600, margin=10)


def _washing_place(plan: FloorPlan) -> None:
    """Place a basin in a vanity unit, two of them, or one on a pedestal, and a mirror above."""
    rng = plan.rng
    if rng.random() < 0.3:
        placed = plan.against_wall(bathroom_fixtures.pedestal_sink(rng), plan.any_walls(), access=600, margin=60)
        if placed:
            plan.at(_mirror(rng, placed.model.width), placed.spot._replace(height=1150), margin=0)
        return
    style = appliances.CabinetStyle.draw(rng, height=860, depth=560)
    basin = appliances.sink(rng, 520, 360)
    width = basin.width + rng.randrange(160, 400, 2)
    unit = appliances.sink_counter(style, width, basin)
    twin = rng.random() < 0.25
    placed = plan.against_wall(unit, plan.any_walls(), access=600, margin=20)
    while placed:
        plan.add(basin, appliances.basin_spot(style, basin, placed.spot))
        plan.at(_mirror(rng, width - 40), placed.spot._replace(height=1150), margin=0)
        x, z = placed.spot.point(width, 0)
        placed = plan.at(unit, Spot(x, z, 0, placed.spot.quarter), access=600, margin=0) if twin else None
        twin = False


def _mirror(rng: Random, width: int) -> Model:
    """A framed mirror, for the wall; its colour stands for what it reflects."""
    half, height = width // 2, rng.randint(700, 900)
    return Model.of(
        "Mirror",
        [
            box((-half, half), (0, 18), (0, height), paint(rng, rng.choice(("wood", "white", "steel")))),
            box((-half + 30, half - 30), (18, 22), (30, height - 30), paint(rng, "mirror")),
        ],
    )
