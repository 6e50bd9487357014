"""The walk by which an agent gets to know a room [4.1.1, "explore the room"].

The walk is seeded by the room's name alone, so every agent that explores a room makes the same one.
"""

import random
from collections import deque

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.actions import Action


def explore(transitions: NDArray[np.int32], room: str, budget: int | None = None) -> NDArray[np.int64]:
    """Walk through a room by legal moves until every view that can be reached was seen.

    The agent always goes to the nearest view that it has not seen, turning first, then looking up or down, then
    moving; so it looks all around at a position before it leaves. It starts at a seeded pose and turns in a seeded
    direction.

    Args:
        transitions: View after each action from each view, int32 [V, 6]; an illegal move keeps the view.
        room: Name of the room, such as ``kitchen/3``: the seed.
        budget: Most actions to take; ``None``: as many as it takes.

    Returns:
        The views in the order in which they were first seen, each once, int64 [M], M >= 1.
    """
    chooser = random.Random(f"explore {room}")
    turns = [Action.ROTATE_LEFT, Action.ROTATE_RIGHT]
    chooser.shuffle(turns)
    order = [*turns, Action.LOOK_UP, Action.LOOK_DOWN, Action.MOVE_AHEAD]
    # Plain lists: reading single elements of an array is many times slower.
    neighbours: list[list[int]] = transitions[:, order].tolist()

    view = chooser.randrange(len(neighbours))
    seen = {view: None}  # a dict keeps the order
    actions = 0
    while path := _path_to_unseen(view, neighbours, seen):
        for view in path:
            if actions == budget:
                return np.array(list(seen), dtype=np.int64)
            actions += 1
            seen.setdefault(view)
    return np.array(list(seen), dtype=np.int64)


def _path_to_unseen(start: int, neighbours: list[list[int]], seen: dict[int, None]) -> list[int]:
    """Return the views on a shortest way from ``start`` (left out) to one not in ``seen``; empty if there is none."""
    came_from = {start: start}
    queue = deque([start])
    while queue:
        view = queue.popleft()
        for neighbour in neighbours[view]:
            if neighbour in came_from:
                continue
            came_from[neighbour] = view
            if neighbour not in seen:
                return _way_back(neighbour, start, came_from)
            queue.append(neighbour)
    return []


def _way_back(view: int, start: int, came_from: dict[int, int]) -> list[int]:
    """Follow ``came_from`` from ``view`` to ``start`` and return the way there, ``start`` left out."""
    path = []
    while view != start:
        path.append(view)
        view = came_from[view]
    return path[::-1]
