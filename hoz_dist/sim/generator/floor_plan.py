"""A room under construction: its walls, what stands in it already, and what must stay free."""

from collections.abc import Iterable, Mapping
from random import Random
from typing import Final, NamedTuple

from hoz_dist.sim.generator.solids import Model, Placed, Rect, Spot, Top
from hoz_dist.sim.room import Item

WALLS: Final = (0, 1, 2, 3)
"""Named by where an object in front of them looks: 0 at z = 0, 1 at x = 0, 2 at z = depth, 3 at x = width."""
_STEP: Final = 50
"""Distance between tried places along a wall or on the floor."""
_GAP: Final = 15
"""Least distance between things on one surface."""
_TRIES: Final = 40
_AGENT_LOW: Final = 50
"""What is lower, such as a rug, does not stop the agent."""
_AGENT_HIGH: Final = 1600


class Surface(NamedTuple):
    """A place in the room where things can stand."""

    owner: Placed
    rect: Rect
    height: int
    top: Top


class FloorPlan:
    """Places models so that nothing interpenetrates and the agent's ways stay free."""

    def __init__(self, rng: Random, width: int, depth: int, height: int, *, outer: tuple[int, ...] = WALLS) -> None:
        """Start with an empty room.

        Args:
            rng: Where all choices come from.
            width: Extent along x.
            depth: Extent along z.
            height: Of the ceiling.
            outer: Walls with nothing but the open air behind them; they may have windows.
        """
        self.rng = rng
        self.width = width
        self.depth = depth
        self.height = height
        self.outer = outer
        self.placed: list[Placed] = []
        self.kept: list[Rect] = []

    @property
    def area(self) -> Rect:
        """The whole floor."""
        return Rect(0, 0, self.width, self.depth)

    @property
    def items(self) -> tuple[Item, ...]:
        """What was placed, in metres."""
        return tuple(placed.item for placed in self.placed)

    def wall_length(self, wall: int) -> int:
        """Return the length of a wall."""
        return self.width if wall % 2 == 0 else self.depth

    def wall_spot(self, wall: int, along: int, height: int = 0, off: int = 0) -> Spot:
        """Return the spot of a model whose back stands at a wall.

        Args:
            wall: One of `WALLS`.
            along: Distance of the model's middle from the wall's left end, as seen with the back to the wall's outside.
            height: Of the model's base.
            off: Distance between wall and model.
        """
        corner = ((0, 0), (0, self.depth), (self.width, self.depth), (self.width, 0))[wall]
        x, z = Spot(*corner, quarter=wall).point(along, off)
        return Spot(x, z, height, wall)

    def has(self, category: str) -> bool:
        """Say whether an object of a category was placed."""
        return any(placed.category == category for placed in self.placed)

    def fits(self, model: Model, spot: Spot, margin: int = 0, *, on_ways: bool = False) -> bool:
        """Say whether a model can be placed.

        Args:
            model: What to place.
            spot: Where.
            margin: Least horizontal distance from other objects.
            on_ways: Whether it may stand on floor that is kept free.
        """
        candidate = Placed.of(model, spot)
        if not self.area.holds(candidate.rect):
            return False
        if not on_ways and spot.height < _AGENT_LOW and any(candidate.rect.overlaps(kept) for kept in self.kept):
            return False
        around = candidate.rect.grown(margin)
        near = [other for other in self.placed if around.overlaps(other.rect)]
        return not any(
            mine.meets(theirs, margin) for other in near for theirs in other.solids for mine in candidate.solids
        )

    def is_clear(self, rect: Rect) -> bool:
        """Say whether nothing stands on an area of the floor that the agent would touch."""
        return self.area.holds(rect) and not any(
            solid.rect.overlaps(rect) and solid.h[0] < _AGENT_HIGH and solid.h[1] > _AGENT_LOW
            for other in self.placed
            if other.rect.overlaps(rect)
            for solid in other.solids
        )

    def add(self, model: Model, spot: Spot) -> Placed:
        """Place a model without asking whether it fits."""
        placed = Placed.of(model, spot)
        self.placed.append(placed)
        return placed

    def keep_free(self, rect: Rect) -> None:
        """Keep floor-standing things placed later off an area."""
        self.kept.append(rect)

    def against_wall(
        self, model: Model, walls: Iterable[int] = WALLS, *, access: int = 0, height: int = 0, margin: int = 20
    ) -> Placed | None:
        """Place a model with its back at a random free stretch of the walls.

        Args:
            model: What to place.
            walls: Walls to try, in this order.
            access: Length of the area in front that is and stays free for the agent.
            height: Of the model's base.
            margin: Least distance from other objects.

        Returns:
            The placed object, or None where there is no room for it.
        """
        for wall in walls:
            half = (model.width + 1) // 2
            places = list(range(half, self.wall_length(wall) - half + 1, _STEP))
            self.rng.shuffle(places)
            for along in places:
                placed = self.at(model, self.wall_spot(wall, along, height), access=access, margin=margin)
                if placed:
                    return placed
        return None

    def any_walls(self) -> list[int]:
        """Return the walls in random order."""
        return self.rng.sample(WALLS, len(WALLS))

    def at(self, model: Model, spot: Spot, *, access: int = 0, margin: int = 20) -> Placed | None:
        """Place a model at a spot if it fits and the area in front of it is free."""
        front = spot.rect(Rect(model.rect.x0, model.rect.z1, model.rect.x1, model.rect.z1 + access))
        if not self.fits(model, spot, margin) or (access and not self.is_clear(front)):
            return None
        if access:
            self.keep_free(front)
        return self.add(model, spot)

    def on_floor(self, model: Model, around: int) -> Placed | None:
        """Place a model, at any quarter turn, where the floor around it is free too.

        Args:
            model: What to place.
            around: Width of the free strip on all sides.
        """
        spots = [
            Spot(x, z, 0, quarter)
            for quarter in (0, 1)
            for x in range(0, self.width, 2 * _STEP)
            for z in range(0, self.depth, 2 * _STEP)
        ]
        self.rng.shuffle(spots)
        for spot in spots:
            if self.is_clear(spot.rect(model.rect.grown(around))) and self.fits(model, spot):
                return self.add(model, spot)
        return None

    def surfaces(self, category: str) -> list[Surface]:
        """Return the surfaces of the placed objects of a category."""
        return [
            Surface(owner, owner.spot.rect(top.rect), owner.spot.height + top.height, top)
            for owner in self.placed
            if owner.category == category
            for top in owner.model.tops
        ]

    def put(self, model: Model, places: Mapping[str, int], *, turn: bool = False) -> Placed | None:
        """Put a thing on a receptacle.

        Args:
            model: What to put.
            places: Weight of each category of receptacle; absent or full ones pass their share to the others.
            turn: Whether the thing may look any way; otherwise it looks where its receptacle looks.

        Returns:
            The placed thing, or None where no receptacle has room for it.
        """
        remaining = dict(places)
        while remaining:
            category = self.rng.choices(list(remaining), list(remaining.values()))[0]
            del remaining[category]
            surfaces = self.surfaces(category)
            self.rng.shuffle(surfaces)
            for surface in surfaces:
                placed = self.put_on(model, surface, turn=turn)
                if placed:
                    return placed
        return None

    def put_on(self, model: Model, surface: Surface, *, turn: bool = False) -> Placed | None:
        """Put a thing at a random free place of a surface, or return None."""
        if model.height > surface.top.clear:
            return None
        for _ in range(_TRIES):
            quarter = self.rng.choice(WALLS) if turn else surface.owner.spot.quarter
            spot = (
                self._middle(model, surface, quarter) if surface.top.centred else self._place(model, surface, quarter)
            )
            if spot and self.fits(model, spot, _GAP):
                return self.add(model, spot)
        return None

    def _place(self, model: Model, surface: Surface, quarter: int) -> Spot | None:
        """Draw a spot where a thing lies within a surface, often at its ends; None if the thing is too large."""
        origin, area = Spot(0, 0, 0, quarter).rect(model.rect), surface.rect
        x0, x1 = area.x0 - origin.x0, area.x1 - origin.x1
        z0, z1 = area.z0 - origin.z0, area.z1 - origin.z1
        if x0 > x1 or z0 > z1:
            return None
        x, z = self.rng.randint(x0, x1), self.rng.randint(z0, z1)
        # Things of a small table would shut each other out if all of them stood in its middle.
        end = self.rng.randrange(4)
        if surface.owner.spot.quarter % 2 == 0:
            x = (x0, x1, x, x)[end]
        else:
            z = (z0, z1, z, z)[end]
        return Spot(x, z, surface.height, quarter)

    def _middle(self, model: Model, surface: Surface, quarter: int) -> Spot:
        """Return the spot where the middle of a thing's lowest part is over the middle of a surface."""
        foot, area = Spot(0, 0, 0, quarter).rect(model.solids[0].rect), surface.rect
        x, z = (area.x0 + area.x1 - foot.x0 - foot.x1) // 2, (area.z0 + area.z1 - foot.z0 - foot.z1) // 2
        return Spot(x, z, surface.height, quarter)
