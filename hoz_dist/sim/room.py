"""A room as plain data: which objects stand where, and the parts that they are made of.

Coordinates are metres in the paper's axes: x to the right, z ahead, height up; the floor is at height 0 and spans
[0, width] x [0, depth]. PyBullet's (x, y, z) is our (x, z, height).
"""

import hashlib
import json
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Literal

from hoz_dist.nav.rooms import RoomId

Vector = tuple[float, float, float]
"""(x, z, height)."""


@dataclass(frozen=True, slots=True)
class Part:
    """One primitive solid of an object, axis-aligned, in room coordinates."""

    shape: Literal["box", "cylinder"]
    size: Vector
    """Full extent along x, z and height, metres; a cylinder stands upright and has equal x and z extents."""
    centre: Vector
    colour: Vector
    """Red, green, blue in [0, 1]."""

    @property
    def low(self) -> Vector:
        """Corner with the smallest coordinates."""
        (x, z, h), (sx, sz, sh) = self.centre, self.size
        return (x - sx / 2, z - sz / 2, h - sh / 2)

    @property
    def high(self) -> Vector:
        """Corner with the largest coordinates."""
        (x, z, h), (sx, sz, sh) = self.centre, self.size
        return (x + sx / 2, z + sz / 2, h + sh / 2)


@dataclass(frozen=True, slots=True)
class Item:
    """An object, a piece of furniture or the shell of the room; one PyBullet body."""

    category: str
    """A target category such as ``Microwave``, or a name such as ``Counter`` or ``Walls``."""
    parts: tuple[Part, ...]

    @property
    def low(self) -> Vector:
        """Corner of the item's box with the smallest coordinates."""
        return tuple(min(part.low[axis] for part in self.parts) for axis in range(3))  # type: ignore[return-value]

    @property
    def high(self) -> Vector:
        """Corner of the item's box with the largest coordinates."""
        return tuple(max(part.high[axis] for part in self.parts) for axis in range(3))  # type: ignore[return-value]


@dataclass(frozen=True)
class Room:
    """One room; everything that the world and the camera show of it follows from this."""

    room: RoomId
    width: float
    """Extent along x, metres."""
    depth: float
    """Extent along z, metres."""
    items: tuple[Item, ...]

    @cached_property
    def digest(self) -> str:
        """Hexadecimal digest of the room's content, the same on every machine."""
        text = json.dumps(asdict(self), sort_keys=True, separators=(",", ":"))
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
