"""A version of the parameters that arrives in shards."""

import numpy as np
import xxhash
from numpy.typing import NDArray

from hoz_dist.wire.protocol.message import SHARD_ELEMENTS
from hoz_dist.wire.protocol.parameters import Parameters, ParametersHead, ParametersShard
from hoz_dist.wire.protocol.rejection import Reason, RejectedError


class Download:
    """The shards that have come so far, all of one version and in order.

    Attributes:
        head: Head of the version; None before the first shard.
        next: Number of the next shard.
    """

    head: ParametersHead | None
    next: int

    def __init__(self) -> None:
        self.begin_again()

    def begin_again(self) -> None:
        """Drop what has come."""
        self.head = None
        self.next = 0
        self._vector: NDArray[np.float32] = np.empty(0, "<f4")
        self._digest = xxhash.xxh3_64()

    def add(self, shard: ParametersShard) -> bool:
        """Take the next shard; False, and nothing is changed, when it is another one, or of another version."""
        if shard.shard != self.next or (self.head is not None and not _same(shard.head, self.head)):
            return False
        if self.head is None:
            self.head = shard.head
            self._vector = np.empty(shard.head.size, "<f4")
        start = self.next * SHARD_ELEMENTS
        self._vector[start : start + SHARD_ELEMENTS] = shard.values
        self._digest.update(shard.values.data)
        self.next += 1
        return True

    def result(self) -> Parameters | None:
        """Return the parameters; None while shards are missing.

        Raises:
            RejectedError: They do not have the digest of their head.
        """
        if self.head is None or self.next < self.head.shards:
            return None
        if self._digest.hexdigest() != self.head.digest:
            raise RejectedError(Reason.DIGEST, "the parameters do not have the digest of their head")
        self._vector.flags.writeable = False
        return Parameters(self.head, self._vector)


def _same(one: ParametersHead, other: ParametersHead) -> bool:
    return (one.stamp, one.digest, one.size) == (other.stamp, other.digest, other.size)
