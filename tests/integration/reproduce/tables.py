"""A table and a budget that take seconds."""

from hoz_dist.nav.rooms import Split
from hoz_dist.reproduce.budget import Budget
from hoz_dist.reproduce.row import Row, Table
from tests.integration.commands import SMALL_ROOMS

TINY_TABLE = Table(
    name="tiny",
    title="Two rows of one training",
    references=("hoz",),
    scenes=SMALL_ROOMS,
    rows=(Row(name="hoz", agent="hoz"), Row(name="order 1", agent="hoz", tested_with={"merge_order": 1})),
)
TINY_BUDGET = Budget(
    name="tiny",
    room_frames=24_000,
    apartment_frames=24_000,
    seeds=1,
    more_seeds=1,
    trials=2,
    test_episodes=20,
    validation_episodes=10,
    checkpoints=4,
    candidates=2,
)
FEW_ROOMS: dict[Split, range] = {"train": range(1, 21), "val": range(21, 22), "test": range(26, 27)}
"""Split of the bathrooms, with less to render."""
