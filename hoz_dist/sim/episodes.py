"""Drawing episodes: at random for training, as a fixed seeded list for evaluation."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.categories import TARGETS, scene_index
from hoz_dist.nav.episode import Episode
from hoz_dist.nav.pose import PITCHES
from hoz_dist.sim.room_views import RoomViews

TRAINING_PITCHES: Final[tuple[int, ...]] = (0,)
"""Pitch at the start of a training episode, degrees (released protocol)."""
EVALUATION_PITCHES: Final[tuple[int, ...]] = PITCHES
"""Pitch at the start of an evaluation episode, degrees (released protocol)."""


class EpisodeSampler:
    """Draws a room, then a target that the room holds, then a start from which that target has to be searched.

    Every draw is uniform. Which starts are valid (the target can be reached, and Done would not succeed yet) depends
    on the target, so the target is drawn before the start; each target of a room is then asked for equally often,
    however few starts it has.
    """

    def __init__(self, pitches: tuple[int, ...] = TRAINING_PITCHES) -> None:
        """Make a sampler without rooms.

        Args:
            pitches: Pitches at the start of an episode, degrees.
        """
        self._pitches = [PITCHES.index(pitch) for pitch in pitches]
        self._rooms: list[RoomViews] = []
        self._starts: list[dict[int, NDArray[np.integer]]] = []

    def add_room(self, views: RoomViews) -> None:
        """Let later episodes also come from a room.

        Raises:
            InvalidValueError: No episode can start in the room.
        """
        allowed = np.isin(views.graph.pitch_indices, self._pitches)
        optimal = np.asarray(views.optimal)
        starts: dict[int, NDArray[np.integer]] = {}
        for target in views.targets:
            valid = np.flatnonzero(allowed & (optimal[:, target] > 0))
            if valid.size:
                starts[target] = valid.astype(np.int32)
        if not starts:
            message = f"No episode can start in room {views.room}: it has no target that has to be searched for."
            raise InvalidValueError(message)
        self._rooms.append(views)
        self._starts.append(starts)

    def sample(self, rng: np.random.Generator, target: int | None = None) -> tuple[int, Episode]:
        """Draw an episode.

        Args:
            rng: Source of the three draws.
            target: The target category if it is not to be drawn.

        Returns:
            The number of the room, in the order in which rooms were added, and the episode.

        Raises:
            InvalidValueError: The room that was drawn has no episode with that target.
        """
        number = int(rng.integers(len(self._rooms)))
        views, starts = self._rooms[number], self._starts[number]
        if target is None:
            target = list(starts)[rng.integers(len(starts))]
        elif target not in starts:
            held = ", ".join(TARGETS[known] for known in starts)
            message = f"Room {views.room} has no {TARGETS[target]} to search for; it has {held}."
            raise InvalidValueError(message)
        valid = starts[target]
        start = int(valid[rng.integers(len(valid))])
        return number, Episode(views.room, start, target, int(views.optimal[start, target]))


def episode_list(rooms: Sequence[RoomViews], count: int, seed: int) -> list[Episode]:
    """Draw the fixed list of episodes of an evaluation.

    The list follows from the rooms and the seed alone: not from the machine, the process or the order of the rooms.

    Args:
        rooms: Rooms to draw from.
        count: Number of episodes.
        seed: Any non-negative number.

    Raises:
        InvalidValueError: There are no rooms, or no episode can start in one of them.
    """
    if not rooms:
        message = "Episodes need at least one room."
        raise InvalidValueError(message)
    ordered = sorted(rooms, key=lambda views: (scene_index(views.room.scene), views.room.number))
    sampler = EpisodeSampler(EVALUATION_PITCHES)
    entropy = [seed]
    for views in ordered:
        sampler.add_room(views)
        entropy += [scene_index(views.room.scene), views.room.number]
    rng = np.random.default_rng(entropy)
    return [sampler.sample(rng)[1] for _ in range(count)]
