"""What a learner answers to a push; frozen, and checked when they are made."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from hoz_dist.wire.protocol.message import (
    Message,
)
from hoz_dist.wire.protocol.rejection import LONGEST_DETAIL, Reason, RejectedError
from hoz_dist.wire.protocol.schema import Int, OneOf, Text


@dataclass(frozen=True, eq=False)
class Accepted(Message):
    """The push counts, now or because it already did; the newest parameters are those of this epoch and version."""

    KIND: ClassVar[str] = "accepted"

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]


@dataclass(frozen=True, eq=False)
class Busy(Message):
    """The learner of this epoch has too much to do; push again after a while."""

    KIND: ClassVar[str] = "busy"

    epoch: Annotated[int, Int()]


@dataclass(frozen=True, eq=False)
class Refused(Message):
    """The message does not count and must not be repeated; or the question cannot be answered.

    Attributes:
        reason: Why, by code.
        detail: A sentence for people.
        epoch: Epoch of the learner that says so; 0 when no learner said it.
    """

    KIND: ClassVar[str] = "refused"

    reason: Annotated[str, OneOf(frozenset(Reason))]
    detail: Annotated[str, Text(LONGEST_DETAIL)]
    epoch: Annotated[int, Int()] = 0

    @classmethod
    def of(cls, error: RejectedError, epoch: int) -> "Refused":
        """Return the refusal of a message that the learner of an epoch rejects."""
        return cls(error.reason.value, error.detail, epoch)


PushReply = Accepted | Busy | Refused
