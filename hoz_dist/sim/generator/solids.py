"""Solids, models and where they stand, in whole millimetres, so that every machine gets the same room."""

from collections.abc import Iterable
from dataclasses import dataclass
from random import Random
from typing import Literal, NamedTuple, Self

from hoz_dist.sim.generator.palette import Colour
from hoz_dist.sim.room import Item, Part

Span = tuple[int, int]
"""From, to, in millimetres."""


class Rect(NamedTuple):
    """An area seen from above, millimetres."""

    x0: int
    z0: int
    x1: int
    z1: int

    def overlaps(self, other: "Rect") -> bool:
        """Say whether the areas share more than an edge."""
        return self.x0 < other.x1 and other.x0 < self.x1 and self.z0 < other.z1 and other.z0 < self.z1

    def grown(self, margin: int) -> "Rect":
        """Return the area with a margin added on each side."""
        return Rect(self.x0 - margin, self.z0 - margin, self.x1 + margin, self.z1 + margin)

    def holds(self, other: "Rect") -> bool:
        """Say whether the other area lies inside this one."""
        return self.x0 <= other.x0 and self.z0 <= other.z0 and other.x1 <= self.x1 and other.z1 <= self.z1


class Solid(NamedTuple):
    """A box or an upright cylinder, given by its extents."""

    shape: Literal["box", "cylinder"]
    x: Span
    z: Span
    h: Span
    colour: Colour

    @property
    def rect(self) -> Rect:
        """The solid seen from above."""
        return Rect(self.x[0], self.z[0], self.x[1], self.z[1])

    def meets(self, other: "Solid", margin: int = 0) -> bool:
        """Say whether two solids interpenetrate, or come horizontally closer than a margin."""
        return self.h[0] < other.h[1] and other.h[0] < self.h[1] and self.rect.grown(margin).overlaps(other.rect)

    def part(self) -> Part:
        """Return the solid in metres."""
        spans = (self.x, self.z, self.h)
        size = tuple((high - low) / 1000 for low, high in spans)
        centre = tuple((low + high) / 2000 for low, high in spans)
        return Part(self.shape, size, centre, self.colour)  # type: ignore[arg-type]


def box(x: Span, z: Span, h: Span, colour: Colour) -> Solid:
    """Make a box."""
    return Solid("box", x, z, h, colour)


def cylinder(x: int, z: int, diameter: int, h: Span, colour: Colour) -> Solid:
    """Make an upright cylinder around (x, z)."""
    radius = diameter // 2
    return Solid("cylinder", (x - radius, x + radius), (z - radius, z + radius), h, colour)


class Top(NamedTuple):
    """A place on a model where things can stand."""

    rect: Rect
    height: int
    clear: int = 2000
    """Free height above it."""
    centred: bool = False
    """Whether a thing stands in the middle of it (a pot on a burner), even where it is wider than the top."""


@dataclass(frozen=True)
class Model:
    """An object in its own frame: x from left to right around 0, back at z = 0, front ahead of it, standing at 0."""

    category: str
    solids: tuple[Solid, ...]
    tops: tuple[Top, ...] = ()

    @property
    def rect(self) -> Rect:
        """The model seen from above."""
        return Rect(
            min(solid.x[0] for solid in self.solids),
            min(solid.z[0] for solid in self.solids),
            max(solid.x[1] for solid in self.solids),
            max(solid.z[1] for solid in self.solids),
        )

    @property
    def width(self) -> int:
        """Extent from left to right."""
        return self.rect.x1 - self.rect.x0

    @property
    def depth(self) -> int:
        """Extent from back to front."""
        return self.rect.z1 - self.rect.z0

    @property
    def height(self) -> int:
        """Extent upwards from where it stands."""
        return max(solid.h[1] for solid in self.solids)

    @classmethod
    def of(cls, category: str, solids: Iterable[Solid], *tops: Top) -> Self:
        """Make a model from its solids."""
        return cls(category, tuple(solids), tops)


class Spot(NamedTuple):
    """Where a model's origin is in the room and which way its front looks."""

    x: int
    z: int
    height: int = 0
    quarter: int = 0
    """The front's yaw in quarter turns: 0 looks along +z, 1 along +x, 2 along -z, 3 along -x."""

    def point(self, x: int, z: int) -> tuple[int, int]:
        """Bring a point of the model's frame into the room."""
        turned = ((x, z), (z, -x), (-x, -z), (-z, x))[self.quarter % 4]
        return self.x + turned[0], self.z + turned[1]

    def rect(self, local: Rect) -> Rect:
        """Bring an area of the model's frame into the room."""
        (xa, za), (xb, zb) = self.point(local.x0, local.z0), self.point(local.x1, local.z1)
        return Rect(min(xa, xb), min(za, zb), max(xa, xb), max(za, zb))

    def solid(self, local: Solid) -> Solid:
        """Bring a solid of the model's frame into the room."""
        rect = self.rect(local.rect)
        low, high = local.h
        return Solid(
            local.shape,
            (rect.x0, rect.x1),
            (rect.z0, rect.z1),
            (low + self.height, high + self.height),
            local.colour,
        )


@dataclass(frozen=True)
class Placed:
    """A model at its spot."""

    model: Model
    spot: Spot
    solids: tuple[Solid, ...]
    """In the room."""
    rect: Rect
    """Seen from above, in the room."""

    @classmethod
    def of(cls, model: Model, spot: Spot) -> Self:
        """Put a model at a spot."""
        return cls(model, spot, tuple(map(spot.solid, model.solids)), spot.rect(model.rect))

    @property
    def category(self) -> str:
        """The model's category."""
        return self.model.category

    @property
    def item(self) -> Item:
        """The object in metres."""
        return Item(self.model.category, tuple(solid.part() for solid in self.solids))


def vary(rng: Random, length: int, percent: int = 15) -> int:
    """Return an even length within some percent of the given one."""
    spread = length * percent // 100
    return (length + rng.randint(-spread, spread)) // 2 * 2
