"""A version of the parameters: what tells which it is, its parts on the wire, and the whole."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final, NamedTuple

import numpy as np
import xxhash
from numpy.typing import NDArray

from hoz_dist.wire.protocol.message import (
    DIGEST,
    MAX_PARAMETERS,
    SHARD_ELEMENTS,
    SMALL_BYTES,
    Message,
)
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.schema import Bool, Int, Record, Tensor

SHARD_BYTES: Final = 4 * SHARD_ELEMENTS
"""Bytes of the values of a full shard, of whatever type they are."""
BLOCK: Final = 256
"""Values of a delta that share a scale."""
NO_BASE: Final = "none"
"""Stands for the digest of the base in a question of who wants deltas and has no base yet."""


@dataclass(frozen=True, eq=False)
class ParametersHead(Message):
    """Which parameters are the newest.

    Attributes:
        epoch: Grows by one whenever a learner starts.
        version: Number of updates applied to the parameters; never falls within an epoch.
        size: P, the number of parameters.
    """

    KIND: ClassVar[str] = "parameters"

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]
    size: Annotated[int, Int(1, MAX_PARAMETERS)]

    @property
    def stamp(self) -> tuple[int, int]:
        """Epoch and version; a later one is greater."""
        return self.epoch, self.version


@dataclass(frozen=True, eq=False)
class ParametersShard(Message):
    """A part of the parameter vector.

    Attributes:
        head: The parameters that it is a part of.
        shard: Its number, from 0; the vector is the shards in order.
        values: f32, the part; `LENGTH` of them, or the rest.
    """

    KIND: ClassVar[str] = "shard"
    MOST_BYTES: ClassVar[int] = SHARD_BYTES + SMALL_BYTES
    BULK: ClassVar[bool] = True
    LENGTH: ClassVar[int] = SHARD_ELEMENTS

    head: Annotated[ParametersHead, Record(ParametersHead)]
    shard: Annotated[int, Int()]
    values: Annotated[NDArray[np.float32], Tensor("float32", rank=1, most=SHARD_ELEMENTS, bulk=True)]

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_part(self)

    @property
    def epoch(self) -> int:
        """Epoch of the learner that serves it."""
        return self.head.epoch


@dataclass(frozen=True, eq=False)
class ParametersDelta(Message):
    """A part of the difference between the parameters and a base that the reader has; see `deltas`.

    Attributes:
        head: The parameters that it is a part of.
        base: `digest_of` the base.
        renews: Whether the parameters that it makes are a base as well, to be kept.
        shard: Its number, from 0.
        scales: f32, one for each `BLOCK` of values.
        values: i8, the part; `LENGTH` of them, or the rest.
    """

    KIND: ClassVar[str] = "delta"
    MOST_BYTES: ClassVar[int] = SHARD_BYTES + SMALL_BYTES
    BULK: ClassVar[bool] = True
    LENGTH: ClassVar[int] = SHARD_BYTES

    head: Annotated[ParametersHead, Record(ParametersHead)]
    base: Annotated[str, DIGEST]
    renews: Annotated[bool, Bool()]
    shard: Annotated[int, Int()]
    scales: Annotated[NDArray[np.float32], Tensor("float32", rank=1, most=SHARD_BYTES // BLOCK, low=0.0, bulk=True)]
    values: Annotated[NDArray[np.int8], Tensor("int8", rank=1, most=SHARD_BYTES, bulk=True)]

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_part(self)
        blocks = -(-self.values.size // BLOCK)
        if self.scales.size != blocks:
            raise RejectedError(Reason.SHAPE, f"{self.values.size} values have {blocks} scales, not {self.scales.size}")

    @property
    def epoch(self) -> int:
        """Epoch of the learner that serves it."""
        return self.head.epoch


Part = ParametersShard | ParametersDelta


class Parameters(NamedTuple):
    """A version of the parameters."""

    head: ParametersHead
    vector: NDArray[np.float32]
    """[P], read-only."""


def shards_of(size: int, part: type[Part]) -> int:
    """Return in how many parts of a kind P parameters are served."""
    return -(-size // part.LENGTH)


def digest_of(vector: NDArray[np.float32]) -> str:
    """Return the digest by which a base is known: xxh3_64 of the little-endian f32 vector, 16 hexadecimal digits."""
    return xxhash.xxh3_64_hexdigest(vector.data)


def _check_part(part: Part) -> None:
    """Judge whether a part has the number and the length of one of its parameters.

    Raises:
        RejectedError: It has not.
    """
    shards = shards_of(part.head.size, type(part))
    if part.shard >= shards:
        raise RejectedError(Reason.RANGE, f"shard is {part.shard}, and there are {shards}")
    wanted = min(part.LENGTH, part.head.size - part.shard * part.LENGTH)
    if part.values.size != wanted:
        raise RejectedError(Reason.SHAPE, f"shard {part.shard} has {part.values.size} elements, not {wanted}")
