"""A version of the parameters: what tells which it is, its parts on the wire, and the whole."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

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
from hoz_dist.wire.protocol.schema import Int, Record, Tensor


@dataclass(frozen=True, eq=False)
class ParametersHead(Message):
    """Which parameters are the newest.

    Attributes:
        epoch: Grows by one whenever a learner starts.
        version: Number of updates applied to the parameters; never falls within an epoch.
        digest: xxh3_64 of the little-endian f32 vector, 16 hexadecimal digits.
        size: P, the number of parameters.
        shards: Number of shards that the vector is served in, of `SHARD_ELEMENTS` but the last.
    """

    KIND: ClassVar[str] = "parameters"

    epoch: Annotated[int, Int()]
    version: Annotated[int, Int()]
    digest: Annotated[str, DIGEST]
    size: Annotated[int, Int(1, MAX_PARAMETERS)]
    shards: Annotated[int, Int(1)]

    def __post_init__(self) -> None:
        super().__post_init__()
        shards = -(-self.size // SHARD_ELEMENTS)
        if self.shards != shards:
            raise RejectedError(Reason.RANGE, f"shards is {self.shards}; {self.size} parameters have {shards}")

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
        values: f32, the part.
    """

    KIND: ClassVar[str] = "shard"
    MOST_BYTES: ClassVar[int] = 4 * SHARD_ELEMENTS + SMALL_BYTES

    head: Annotated[ParametersHead, Record(ParametersHead)]
    shard: Annotated[int, Int()]
    values: Annotated[NDArray[np.float32], Tensor("float32", rank=1, most=SHARD_ELEMENTS)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shard >= self.head.shards:
            raise RejectedError(Reason.RANGE, f"shard is {self.shard}, and there are {self.head.shards}")
        wanted = min(SHARD_ELEMENTS, self.head.size - self.shard * SHARD_ELEMENTS)
        if self.values.size != wanted:
            raise RejectedError(Reason.SHAPE, f"shard {self.shard} has {self.values.size} elements, not {wanted}")

    @property
    def epoch(self) -> int:
        """Epoch of the learner that serves it."""
        return self.head.epoch


class Parameters(NamedTuple):
    """A version of the parameters."""

    head: ParametersHead
    vector: NDArray[np.float32]
    """[P], read-only."""


def head_of(epoch: int, version: int, vector: NDArray[np.float32]) -> ParametersHead:
    """Return the head of a parameter vector [P]."""
    digest = xxhash.xxh3_64_hexdigest(vector.data)
    return ParametersHead(epoch, version, digest, len(vector), -(-len(vector) // SHARD_ELEMENTS))
