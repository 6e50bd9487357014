"""Kitchens: worktops along the walls with stove, sink and refrigerator among them, a table, and what is used there."""

from typing import Final, NamedTuple

from hoz_dist.sim.generator import appliances, small_things
from hoz_dist.sim.generator.appliances import CabinetStyle
from hoz_dist.sim.generator.dining import dining_set
from hoz_dist.sim.generator.floor_plan import FloorPlan
from hoz_dist.sim.generator.seating import chair, stool
from hoz_dist.sim.generator.shell import entrance, free_rug, pictures, window, windows
from hoz_dist.sim.generator.solids import Model, Rect, Spot

AISLE: Final = 850
"""Free floor in front of the worktops."""
_LEAST_COUNTER: Final = 300
_CABINET_HEIGHT: Final = 1450


class Run(NamedTuple):
    """A stretch of a wall with worktops."""

    wall: int
    start: int
    end: int
    fridge_at: int
    """Which end a refrigerator may stand at: -1 the left one, 1 the right one."""


def furnish(plan: FloorPlan) -> None:
    """Furnish a kitchen."""
    rng = plan.rng
    style = CabinetStyle.draw(rng)
    runs = _runs(plan, style)
    fill_runs(plan, style, runs)
    used = {run.wall for run in runs}
    entrance(plan, tuple(sorted(plan.any_walls(), key=lambda wall: wall in used)))
    if rng.random() < 0.3:
        model = appliances.island(style, rng.randrange(1000, 1500, 2))
        if plan.on_floor(model, 800):
            _stools(plan)
    if rng.random() < 0.9:
        dining_set(plan, rng.choice((2, 3, 4, 4, 4)))
    if not plan.has("Chair") and rng.random() < 0.5:
        plan.against_wall(chair(rng), plan.any_walls(), access=400)
    plan.against_wall(small_things.garbage_can(rng), plan.any_walls(), access=300)
    if not plan.has("Window") or rng.random() < 0.4:
        windows(plan, 1, curtains=rng.random() < 0.3)
    _small_things(plan)
    pictures(plan, rng.randint(0, 2))
    if rng.random() < 0.3:
        plan.against_wall(small_things.plant(rng), plan.any_walls())
    if rng.random() < 0.6:
        free_rug(plan, 1200, 700)


def _runs(plan: FloorPlan, style: CabinetStyle) -> list[Run]:
    """Choose along which walls the worktops go: one, an L, two opposite ones, or a U."""
    rng = plan.rng
    wall = rng.randrange(4)
    length = plan.wall_length(wall)
    runs = [Run(wall, 0, length, rng.choice((-1, 1)))]
    kind = rng.choices(("one", "L", "galley", "U"), (15, 45, 22, 18))[0]
    side = rng.choice((-1, 1))
    sides = {"one": (), "galley": (), "L": (side,), "U": (-1, 1)}[kind]
    for turn in sides:
        # The wall at our right end is numbered one lower; its own left end is the shared corner.
        other = (wall - turn) % 4
        full = plan.wall_length(other)
        reach = style.depth + min(full - style.depth - 1100, rng.randrange(1300, 2400, 50))
        span = (style.depth, reach) if turn == 1 else (full - reach, full - style.depth)
        runs.append(Run(other, *span, turn))
    if len(sides) == 1:
        runs[0] = runs[0]._replace(fridge_at=-side)
    if kind == "galley":
        other = (wall + 2) % 4
        reach = min(length, rng.randrange(1500, 2600, 50))
        start = rng.choice((0, length - reach))
        runs.append(Run(other, start, start + reach, 1 if start == 0 else -1))
    return runs


def fill_runs(plan: FloorPlan, style: CabinetStyle, runs: list[Run]) -> None:
    """Distribute stove, sink and refrigerator over the runs and fill what is between them with worktops."""
    rng = plan.rng
    basin = appliances.sink(rng, 620, 420)
    stove = appliances.stove(rng, style)
    sink = appliances.sink_counter(style, basin.width + 200, basin)
    fridge = appliances.fridge(rng)
    members: list[list[Model]] = [[] for _ in runs]
    room = [run.end - run.start for run in runs]
    for model in rng.sample((stove, sink, fridge), 3):
        able = [index for index, run in enumerate(runs) if room[index] >= model.width + 2 * _LEAST_COUNTER]
        if model is fridge and len(runs) == 3:
            able = [index for index in able if index > 0] or able
        index = rng.choice(able or [room.index(max(room))])
        room[index] -= model.width
        members[index].append(model)
    for run, models in zip(runs, members, strict=True):
        ordered = [model for model in models if model is not fridge]
        if fridge in models:
            ordered.insert(len(ordered) if run.fridge_at == 1 else 0, fridge)
        _fill(plan, style, run, ordered, basin)
    for run in runs:
        along = (run.start + run.end) // 2
        half = (run.end - run.start) // 2
        plan.keep_free(plan.wall_spot(run.wall, along).rect(Rect(-half, style.depth, half, style.depth + AISLE)))


def _fill(plan: FloorPlan, style: CabinetStyle, run: Run, models: list[Model], basin: Model) -> None:
    """Place models along a run, worktops in the gaps, and what belongs above and in them."""
    rng = plan.rng
    spare = run.end - run.start - sum(model.width for model in models)
    gaps = _split(plan, spare, len(models) + 1)
    if models and models[0].category == "Fridge":
        gaps[1], gaps[0] = gaps[1] + gaps[0], 0
    if models and models[-1].category == "Fridge":
        gaps[-2], gaps[-1] = gaps[-2] + gaps[-1], 0
    along = run.start
    for index, gap in enumerate(gaps):
        if gap >= _LEAST_COUNTER:
            _worktop(plan, style, run.wall, along, gap)
        along += gap
        if index == len(models):
            break
        model = models[index]
        spot = plan.wall_spot(run.wall, along + model.width // 2)
        if plan.fits(model, spot):
            placed = plan.add(model, spot)
            if model.category == "Stove":
                _burners(plan, placed.spot, model)
                extractor = appliances.hood(rng, model.width)
                plan.at(extractor, spot._replace(height=1620), margin=0)
            if model.category == "Counter":
                plan.add(basin, appliances.basin_spot(style, basin, spot))
                if run.wall in plan.outer:
                    view = window(rng, min(model.width, 1000) // 2 * 2, curtains=False)
                    plan.at(view, spot._replace(height=1150))
        along += model.width


def _split(plan: FloorPlan, spare: int, parts: int) -> list[int]:
    """Split a length into parts that are 0 or at least `_LEAST_COUNTER`, even numbers of millimetres."""
    rng = plan.rng
    count = max(1, min(parts, spare // (_LEAST_COUNTER + 150)))
    chosen = sorted(rng.sample(range(parts), count))
    weights = [rng.randint(10, 30) for _ in chosen]
    free = max(0, spare - count * _LEAST_COUNTER)
    gaps = [0] * parts
    for index, weight in zip(chosen, weights, strict=True):
        gaps[index] = (_LEAST_COUNTER + free * weight // sum(weights)) // 2 * 2
    return gaps


def _worktop(plan: FloorPlan, style: CabinetStyle, wall: int, along: int, length: int) -> None:
    """Place a worktop and, mostly, a cupboard over it."""
    spot = plan.wall_spot(wall, along + length // 2)
    model = appliances.counter(style, length // 2 * 2)
    if not plan.fits(model, spot):
        return
    plan.add(model, spot)
    if plan.rng.random() < 0.6:
        cupboard = appliances.wall_cabinet(style, length // 2 * 2)
        plan.at(cupboard, spot._replace(height=_CABINET_HEIGHT), margin=0)


def _burners(plan: FloorPlan, spot: Spot, stove: Model) -> None:
    """Place a burner on each of the stove's four places."""
    rng = plan.rng
    for top in stove.tops:
        model = appliances.burner(rng, rng.choice((170, 190, 210)))
        x, z = spot.point((top.rect.x0 + top.rect.x1) // 2, (top.rect.z0 + top.rect.z1 - model.depth) // 2)
        plan.add(model, Spot(x, z, top.height, spot.quarter))


def _stools(plan: FloorPlan) -> None:
    """Place stools at the island."""
    rng = plan.rng
    island = plan.placed[-1]
    model = stool(rng)
    for along in (island.model.rect.x0 // 2, island.model.rect.x1 // 2):
        x, z = island.spot.point(along, island.model.rect.z1 + 20)
        spot = Spot(x, z, 0, island.spot.quarter)
        if plan.fits(model, spot):
            plan.add(model, spot)


def _small_things(plan: FloorPlan) -> None:
    """Put what is used in a kitchen where it is used (shares of receptacles after the field's statistics)."""
    rng = plan.rng
    counter = {"Counter": 92, "Island": 5, "DiningTable": 3}
    for make, chance in (
        (appliances.microwave, 95),
        (appliances.coffee_machine, 90),
        (appliances.toaster, 92),
    ):
        if rng.randrange(100) < chance:
            plan.put(make(rng), counter)
    if rng.randrange(100) < 92:
        plan.put(small_things.pot(rng), {"StoveBurner": 60, "Counter": 40})
    if rng.randrange(100) < 90:
        plan.put(small_things.pan(rng), {"StoveBurner": 45, "Counter": 55})
    if rng.randrange(100) < 90:
        plan.put(small_things.kettle(rng), {"Counter": 91, "StoveBurner": 9}, turn=True)
    if rng.randrange(100) < 92:
        plate = small_things.plate(rng)
        for _ in range(rng.choice((1, 1, 2))):
            plan.put(plate, {"DiningTable": 55, "Counter": 30, "Island": 15})
    if rng.randrange(100) < 92:
        bowl = small_things.bowl(rng)
        for _ in range(rng.choice((1, 1, 2))):
            plan.put(bowl, {"DiningTable": 45, "Counter": 40, "Island": 15})
