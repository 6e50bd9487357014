"""Why a message is not accepted."""

import re
from enum import StrEnum
from typing import Final

from hoz_dist.errors import HozError


class Reason(StrEnum):
    """The fixed list of reasons; a refusal carries one, and rejections are counted by them."""

    MALFORMED = "malformed"
    """The bytes are not one msgpack map and the bulk that it tells of, or the selector cannot be read."""
    VERSION = "version"
    """The peer speaks another protocol version."""
    KIND = "kind"
    """A message of a kind that is unknown, or does not belong on this key."""
    FIELDS = "fields"
    """A field is missing or unknown."""
    TYPE = "type"
    """A field holds another type than it should."""
    SIZE = "size"
    """The message or a field is too long."""
    DTYPE = "dtype"
    """A tensor has another element type than it should."""
    SHAPE = "shape"
    """A tensor has another shape than it should, or not the bytes that its shape needs."""
    CODEC = "codec"
    """A gradient travels in another form than those of the run."""
    NONFINITE = "nonfinite"
    """A number is NaN or infinite."""
    NORM = "norm"
    """A gradient's norm exceeds the bound of the run."""
    RANGE = "range"
    """A number is out of its range."""
    NAME = "name"
    """A name is unknown or not well formed."""
    CHECKSUM = "checksum"
    """The payload does not have the checksum that travelled with it."""
    IDENTITY = "identity"
    """The sender's name in the message is not the one in the key."""
    EPOCH = "epoch"
    """The message belongs to another epoch of the learner."""
    STALE = "stale"
    """The gradient was computed on parameters that are too old, or on a version that never was."""
    DIGEST = "digest"
    """The room is not the one that its digest says."""
    SPLIT = "split"
    """The room is kept for validation or test."""
    FINISHED = "finished"
    """The run is over: its budget is used up. No fault of the message's, so it is not counted."""
    NOT_FOUND = "not_found"
    """What was asked for is not there yet."""
    GONE = "gone"
    """The version of the parameters that was asked for is not kept any more."""
    INTERNAL = "internal"
    """The learner failed while it answered; its log says why."""


CONTROL: Final = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
"""Characters that could make two lines of one in a log, or do worse to a terminal."""
LONGEST_DETAIL: Final = 2048


def plain(text: str) -> str:
    """Return as much of a text as fits a refusal or a line of a log; whoever caused it may have chosen its words."""
    return CONTROL.sub("?", text[:LONGEST_DETAIL])


def shown(value: object) -> str:
    """Return how a refusal quotes what somebody sent: never more than the beginning, however long the value is."""
    match value:
        case str():
            return repr(value[:40])
        case None | bool() | float():
            return repr(value)
        case int() if value.bit_length() <= 64:  # noqa: PLR2004 - as much as msgpack can hold
            return repr(value)
        case _:
            return f"<{type(value).__name__}>"


class RejectedError(HozError):
    """A message that is not accepted.

    Attributes:
        reason: Why, by code.
        detail: What exactly, for people.
    """

    def __init__(self, reason: Reason, detail: str) -> None:
        self.reason = reason
        self.detail = plain(detail)
        super().__init__(f"Message rejected ({reason}): {self.detail}")


class OtherVersionError(RejectedError):
    """A message of a peer that speaks another version of the protocol.

    Args:
        theirs: What the peer's message has for a version; anything, since it is not of ours.
        ours: The version that this side speaks.
    """

    def __init__(self, theirs: object, ours: int) -> None:
        told = shown(theirs)
        super().__init__(Reason.VERSION, f"the message is of protocol version {told}; this side speaks {ours}")
        sentence = (
            f"The other side speaks protocol version {told}; this side speaks {ours}: "
            "run the same release of hoz-dist on both."
        )
        self.args = (sentence,)
