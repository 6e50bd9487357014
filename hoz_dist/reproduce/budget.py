"""How much a table may cost: frames, seeds and episodes, the same for all of its rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from hoz_dist.nav.categories import ROOM_SCENES


@dataclass(frozen=True, kw_only=True)
class Budget:
    """What each row of a table gets."""

    name: str
    room_frames: int
    """Frames of a training run in rooms."""
    apartment_frames: int
    """Frames of a training run in apartments."""
    seeds: int
    """Training runs of a row."""
    more_seeds: int
    """Training runs of a row on which a comparison hangs."""
    trials: int = 5
    """Trials on the test rooms, as in the paper."""
    test_episodes: int = 1000
    """Episodes of a trial, equally many in each scene."""
    validation_episodes: int = 600
    """Episodes that choose the checkpoint, equally many in each scene."""
    checkpoints: int = 12
    """Checkpoints that a run keeps, equally far from each other."""
    candidates: int = 3
    """Of these the last ones, from which the best on the validation rooms is chosen."""

    def frames(self, scenes: Sequence[str]) -> int:
        """Return the frames of a run in some scenes or rooms."""
        in_rooms = {name.partition("/")[0] for name in scenes} <= set(ROOM_SCENES)
        return self.room_frames if in_rooms else self.apartment_frames


BUDGETS: Final = {
    budget.name: budget
    for budget in (
        Budget(name="quick", room_frames=2_000_000, apartment_frames=3_000_000, seeds=1, more_seeds=2),
        Budget(name="standard", room_frames=3_000_000, apartment_frames=5_000_000, seeds=3, more_seeds=5),
        Budget(name="full", room_frames=16_000_000, apartment_frames=24_000_000, seeds=5, more_seeds=5),
    )
}
"""``quick`` makes the table of methods from nothing in about half an hour on two cores."""
