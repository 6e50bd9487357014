"""Counts which categories stand near each other in the training rooms: ``python -m hoz_dist.sim.closeness``.

For maintainers: prints what the package ships as the relations of method `sp`
(``hoz_dist/policy/relations.json``), in the form that ``--relations`` reads. Validation and test rooms are not looked
at. Names of scenes as arguments count other scenes than the four kinds of single rooms.
"""

import json
import sys
from collections import Counter
from collections.abc import Iterable
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.categories import ROOM_SCENES, TARGETS
from hoz_dist.nav.rooms import rooms_of
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.room import Room

NEAR_M: Final = 1.0
"""Largest gap between the boxes of two instances that are near each other, metres."""
LEAST_SHARE: Final = 1 / 3
"""Share of the rooms that hold both categories in which some of their instances must be near each other."""

Pair = tuple[str, str]
"""Two categories, in the order of `TARGETS`."""


def near_in(room: Room) -> tuple[set[Pair], set[Pair]]:
    """Return the pairs of target categories that a room holds, and those that are near each other in it."""
    boxes: dict[str, list[NDArray[np.float64]]] = {}
    for item in room.items:
        if item.category in TARGETS:
            boxes.setdefault(item.category, []).append(np.array([item.low, item.high]))
    held = set(combinations([name for name in TARGETS if name in boxes], 2))
    return held, {(a, b) for a, b in held if _gap(np.stack(boxes[a]), np.stack(boxes[b])) <= NEAR_M}


def near_pairs(rooms: Iterable[Room]) -> list[tuple[str, str, int]]:
    """Count in how many rooms categories are near each other.

    Args:
        rooms: The rooms.

    Returns:
        Pairs that are near each other in at least `LEAST_SHARE` of the rooms that hold both, and in how many they are;
        in the order of `TARGETS`.
    """
    held: Counter[Pair] = Counter()
    near: Counter[Pair] = Counter()
    for room in rooms:
        both, close = near_in(room)
        held.update(both)
        near.update(close)
    return [(*pair, near[pair]) for pair in combinations(TARGETS, 2) if near[pair] >= LEAST_SHARE * max(held[pair], 1)]


def _gap(these: NDArray[np.float64], those: NDArray[np.float64]) -> float:
    """Return the least distance between any two of some boxes, corners [M, 2, 3] and [L, 2, 3], metres."""
    apart = np.maximum(these[:, None, 0] - those[None, :, 1], those[None, :, 0] - these[:, None, 1])
    return float(np.linalg.norm(apart.clip(min=0.0), axis=-1).min())


def main() -> None:
    """Print the relations of the training rooms."""
    scenes = sys.argv[1:] or ROOM_SCENES
    pairs = near_pairs(load_room(room) for scene in scenes for room in rooms_of(scene, "train"))
    rows = ",\n".join(f"  {json.dumps([a, 'near', b, count])}" for a, b, count in pairs)
    sys.stdout.write(f"[\n{rows}\n]\n")


if __name__ == "__main__":
    main()
