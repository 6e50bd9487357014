"""Why a message is not accepted."""

from enum import StrEnum

from hoz_dist.errors import HozError


class Reason(StrEnum):
    """The fixed list of reasons; a refusal carries one, and rejections are counted by them."""

    MALFORMED = "malformed"
    """The bytes are not one msgpack map, or the selector cannot be read."""
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
    INTERNAL = "internal"
    """The learner failed while it answered; its log says why."""


class RejectedError(HozError):
    """A message that is not accepted.

    Attributes:
        reason: Why, by code.
        detail: What exactly, for people.
    """

    def __init__(self, reason: Reason, detail: str) -> None:
        super().__init__(f"Message rejected ({reason}): {detail}")
        self.reason = reason
        self.detail = detail
