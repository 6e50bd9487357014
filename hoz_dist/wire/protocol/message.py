"""What messages are made of: their base, the specs of fields that several have, and the limits."""

import re
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.checks import MAX_ZONES, check_shapes, check_values
from hoz_dist.nav.categories import SCENES, TARGETS
from hoz_dist.wire.protocol.fields import EpisodeFields, RoomName
from hoz_dist.wire.protocol.keys import NAME_PATTERN
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.schema import Int, Many, OneOf, Structure, Tensor, Text

MAX_PARAMETERS: Final = 30_000_000
"""Largest number of policy parameters; three times the paper's sizes, and within Zenoh's largest message."""
MAX_EPISODES: Final = 4096
MAX_FRAMES: Final = 4096 * 1000
"""Largest number of frames of one gradient: those of the largest batch and rollout that a run may have."""
SHARD_ELEMENTS: Final = 120 * 1024
"""Elements of a full shard, 480 KiB: two fit into the sending queue of a slow client's link."""


SMALL_BYTES: Final = 64 * 1024
GRAPH_BYTES: Final = 1024 * 1024

NAME: Final = Text(64, NAME_PATTERN)
ROOM_DIGEST: Final = Text(64, re.compile(r"[0-9A-Za-z]+"))
DIGEST: Final = Text(16, re.compile(r"[0-9a-f]{16}"))
SCENE: Final = OneOf(frozenset(SCENES))
CATEGORIES: Final = Many(OneOf(frozenset(TARGETS)), len(TARGETS))
NODES: Final = Tensor("float64", rank=2, most=MAX_ZONES * len(TARGETS), low=0.0, high=1.0)
EDGES: Final = Tensor("float64", rank=2, most=MAX_ZONES**2, low=0.0, high=1.0)
ZONE: Final = Int(0, MAX_ZONES - 1)
ROOM: Final = RoomName()
EPISODES: Final = Many(EpisodeFields(), MAX_EPISODES)


class Message(Structure):
    """Base of everything that travels.

    Attributes:
        KIND: Name on the wire.
        MOST_BYTES: Longest encoded form that is read at all.
        MOST_VALUES: Largest number of values, keys and elements of lists and maps together.
        BULK: Whether fields of it are bulk tensors; its map then has at most `SMALL_BYTES`.
    """

    KIND: ClassVar[str]
    MOST_BYTES: ClassVar[int] = SMALL_BYTES
    MOST_VALUES: ClassVar[int] = 16 * 1024
    BULK: ClassVar[bool] = False

    @classmethod
    def most_head_bytes(cls) -> int:
        """Return the length of the longest map that is read of such a message."""
        return SMALL_BYTES if cls.BULK else cls.MOST_BYTES


@dataclass(frozen=True, eq=False)
class Served(Message):
    """Base of what a learner serves that does not tell its epoch otherwise.

    Attributes:
        epoch: Epoch of the learner that serves it.
    """

    epoch: Annotated[int, Int()]


def check_graph(nodes: NDArray[np.float64], edges: NDArray[np.float64], categories: tuple[str, ...]) -> None:
    """Judge whether nodes [K, N], edges [K, K] and categories [N] belong together."""
    if len(set(categories)) != len(categories):
        raise RejectedError(Reason.NAME, "a category occurs twice")
    try:
        check_shapes(nodes, edges, len(categories))
    except InvalidValueError as error:
        raise RejectedError(Reason.SHAPE, str(error)) from error
    try:
        check_values(nodes, edges)
    except InvalidValueError as error:
        raise RejectedError(Reason.RANGE, str(error)) from error
