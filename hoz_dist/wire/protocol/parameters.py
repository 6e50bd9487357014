"""A version of the parameters, and the head that tells which it is."""

from typing import NamedTuple

import numpy as np
import xxhash
from numpy.typing import NDArray

from hoz_dist.wire.protocol.message import SHARD_ELEMENTS
from hoz_dist.wire.protocol.messages import ParametersHead


class Parameters(NamedTuple):
    """A version of the parameters."""

    head: ParametersHead
    vector: NDArray[np.float32]
    """[P], read-only."""


def head_of(epoch: int, version: int, vector: NDArray[np.float32]) -> ParametersHead:
    """Return the head of a parameter vector [P]."""
    digest = xxhash.xxh3_64_hexdigest(vector.data)
    return ParametersHead(epoch, version, digest, len(vector), -(-len(vector) // SHARD_ELEMENTS))
