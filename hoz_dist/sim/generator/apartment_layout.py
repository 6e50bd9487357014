"""Where the rooms of an apartment are, and which of them open into each other."""

from collections.abc import Sequence
from itertools import combinations
from math import isqrt
from random import Random
from typing import Final, NamedTuple

from hoz_dist.sim.generator.floor_plan import WALLS
from hoz_dist.sim.generator.shell import Opening
from hoz_dist.sim.generator.solids import Rect

THICK: Final = 60
"""Of a room's shell; two of them make a wall between rooms."""
_BETWEEN: Final = 2 * THICK
_DOORWAY_HEIGHT: Final = 2080
_FROM_CORNER: Final = 130
"""Least distance of a doorway from a corner of either room: its frame needs room."""
_LEAST_STRETCH: Final = 1150
"""Length of the shared wall that a doorway needs."""
_FLOOR: Final = (40_000_000, 52_000_000)
"""Least and greatest area between the outer walls, mm2: 2.4 times a room's."""
_TRIES: Final = 20_000


class RoomKind(NamedTuple):
    """What a layout must know of a kind of room."""

    share: int
    """Of the floor, beside the other rooms' shares."""
    least: int
    """Shortest side."""
    private: int
    """How little one walks through it: 0 not at all, 2 never."""


KINDS: Final[dict[str, RoomKind]] = {
    "living": RoomKind(180, 3400, 0),
    "kitchen": RoomKind(90, 2200, 0),
    "bedroom": RoomKind(120, 2700, 1),
    "study": RoomKind(88, 2150, 1),
    "bath": RoomKind(52, 1600, 2),
}


class Cell(NamedTuple):
    """A room of an apartment."""

    kind: str
    """One of `KINDS`."""
    inside: Rect
    """Between its walls."""


class Doorway(NamedTuple):
    """A hole through the wall between two rooms, without a door."""

    cells: tuple[int, int]
    """Numbers of the rooms."""
    hole: Rect
    """From the inside of one room to the inside of the other."""


class Layout(NamedTuple):
    """The rooms of an apartment."""

    width: int
    depth: int
    cells: tuple[Cell, ...]
    doorways: tuple[Doorway, ...]

    def openings(self, number: int) -> tuple[Opening, ...]:
        """Return the doorways of a room, as seen from inside it."""
        inside = self.cells[number].inside
        return tuple(_opening(inside, doorway.hole) for doorway in self.doorways if number in doorway.cells)

    def outer_walls(self, number: int) -> tuple[int, ...]:
        """Return the walls of a room that have the open air behind them."""
        inside = self.cells[number].inside
        edges = (inside.z0 == 0, inside.x0 == 0, inside.z1 == self.depth, inside.x1 == self.width)
        return tuple(wall for wall in WALLS if edges[wall])


def draw_layout(rng: Random, kinds: Sequence[str]) -> Layout:
    """Divide a rectangle into rooms, again and again in two, and connect all of them by doorways.

    Args:
        rng: Where all choices come from.
        kinds: Kinds of the rooms.

    Raises:
        RuntimeError: No division was found in which every room has a fair shape and a door.
    """
    for _ in range(_TRIES):
        shares = {kind: KINDS[kind].share * rng.randint(86, 114) for kind in kinds}
        whole = rng.randrange(*_FLOOR)
        width = rng.randrange(isqrt(whole * 10 // 19), isqrt(whole * 19 // 10)) // 10 * 10
        depth = whole // width // 10 * 10
        order = rng.sample(list(kinds), len(kinds))
        cells = _divide(rng, Rect(0, 0, width, depth), order, shares)
        if not all(_is_fair(cell) for cell in cells):
            continue
        doorways = _connect(rng, cells)
        if doorways:
            return Layout(width, depth, tuple(cells), tuple(doorways))
    message = f"No layout was found for {', '.join(kinds)}."
    raise RuntimeError(message)


def _divide(rng: Random, area: Rect, kinds: list[str], shares: dict[str, int]) -> list[Cell]:
    """Divide an area among rooms by their shares, mostly across its longer side."""
    if len(kinds) == 1:
        return [Cell(kinds[0], area)]
    first = rng.randint(1, len(kinds) - 1)
    share = sum(shares[kind] for kind in kinds[:first])
    total = sum(shares[kind] for kind in kinds)
    width, depth = area.x1 - area.x0, area.z1 - area.z0
    if rng.randrange(width**4 + depth**4) < width**4:
        cut = area.x0 + ((width - _BETWEEN) * share // total) // 10 * 10
        halves = area._replace(x1=cut), area._replace(x0=cut + _BETWEEN)
    else:
        cut = area.z0 + ((depth - _BETWEEN) * share // total) // 10 * 10
        halves = area._replace(z1=cut), area._replace(z0=cut + _BETWEEN)
    return [*_divide(rng, halves[0], kinds[:first], shares), *_divide(rng, halves[1], kinds[first:], shares)]


def _is_fair(cell: Cell) -> bool:
    """Say whether a room can be furnished as what it is."""
    sides = sorted((cell.inside.x1 - cell.inside.x0, cell.inside.z1 - cell.inside.z0))
    return sides[0] >= KINDS[cell.kind].least and sides[1] * 10 <= sides[0] * 20


def _connect(rng: Random, cells: list[Cell]) -> list[Doorway]:
    """Open doorways so that all rooms are connected, through the least private ones where that can be had.

    Returns:
        The doorways; none when the rooms cannot be connected, or not without walking through a private one.
    """
    shared = {}
    for pair in combinations(range(len(cells)), 2):
        wall = _shared_wall(cells[pair[0]].inside, cells[pair[1]].inside)
        if wall:
            shared[pair] = wall

    def reluctance(pair: tuple[int, int]) -> int:
        return 2 * sum(KINDS[cells[number].kind].private for number in pair) + rng.randint(0, 3)

    tried = sorted((reluctance(pair), pair) for pair in shared)
    group = list(range(len(cells)))
    chosen = []
    for _, (one, other) in tried:
        if group[one] != group[other]:
            chosen.append((one, other))
            group = [group[one] if mark == group[other] else mark for mark in group]
    if len(set(group)) > 1:
        return []
    degree = [sum(number in pair for pair in chosen) for number in range(len(cells))]
    if any(KINDS[cell.kind].private == 2 and degree[number] > 1 for number, cell in enumerate(cells)):
        return []
    return [Doorway(pair, _hole(rng, shared[pair], {cells[number].kind for number in pair})) for pair in chosen]


def _shared_wall(one: Rect, other: Rect) -> Rect | None:
    """Return the stretch of the wall between two rooms in which a doorway can be; None if it is too short."""
    # How far apart they are along either axis; less than 0 where they face each other.
    x = (max(one.x0, other.x0), min(one.x1, other.x1))
    z = (max(one.z0, other.z0), min(one.z1, other.z1))
    apart = (x[0] - x[1], z[0] - z[1])
    if max(apart) != _BETWEEN or min(apart) > -_LEAST_STRETCH:
        return None
    return Rect(min(x), min(z), max(x), max(z))


def _hole(rng: Random, wall: Rect, kinds: set[str]) -> Rect:
    """Choose where a doorway is in a wall: often near an end, so that furniture has the rest."""
    across_x = wall.x1 - wall.x0 == _BETWEEN
    start, end = (wall.z0, wall.z1) if across_x else (wall.x0, wall.x1)
    width = rng.randrange(840, 960, 10)
    if kinds == {"living", "kitchen"} and rng.random() < 0.5:
        width = rng.randrange(1300, 2000, 10)
    width = min(width, end - start - 2 * _FROM_CORNER)
    low, high = start + _FROM_CORNER, end - _FROM_CORNER - width
    low = rng.choice((low, low, high, high, rng.randint(low, high))) // 10 * 10
    return wall._replace(z0=low, z1=low + width) if across_x else wall._replace(x0=low, x1=low + width)


def _opening(inside: Rect, hole: Rect) -> Opening:
    """Return a hole as an opening in one of a room's walls, along which places count from its left end."""
    if hole.z1 == inside.z0:
        return Opening(0, hole.x0 - inside.x0, hole.x1 - inside.x0, _DOORWAY_HEIGHT)
    if hole.x1 == inside.x0:
        return Opening(1, inside.z1 - hole.z1, inside.z1 - hole.z0, _DOORWAY_HEIGHT)
    if hole.z0 == inside.z1:
        return Opening(2, inside.x1 - hole.x1, inside.x1 - hole.x0, _DOORWAY_HEIGHT)
    return Opening(3, hole.z0 - inside.z0, hole.z1 - inside.z0, _DOORWAY_HEIGHT)
