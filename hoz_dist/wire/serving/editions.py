"""What a reader of parameters reads: a version in full, or as the difference to a base."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hoz_dist.wire.protocol.deltas import Quantised
from hoz_dist.wire.protocol.parameters import (
    BLOCK,
    ParametersDelta,
    ParametersHead,
    ParametersShard,
    shards_of,
)


@dataclass(frozen=True, eq=False)
class Full:
    """A version in full."""

    head: ParametersHead
    vector: NDArray[np.float32]
    """[P], read-only."""

    @property
    def shards(self) -> int:
        """Number of its parts."""
        return shards_of(self.head.size, ParametersShard)

    @property
    def nbytes(self) -> int:
        """Bytes of memory."""
        return self.vector.nbytes

    def part(self, number: int) -> ParametersShard:
        """Return a part that there is."""
        start = number * ParametersShard.LENGTH
        return ParametersShard(self.head, number, self.vector[start : start + ParametersShard.LENGTH])


@dataclass(frozen=True, eq=False)
class Delta:
    """A version as the difference to a base."""

    head: ParametersHead
    base: str
    """Digest of the base."""
    renews: bool
    """Whether it is a base as well."""
    difference: Quantised

    @property
    def shards(self) -> int:
        """Number of its parts."""
        return shards_of(self.head.size, ParametersDelta)

    @property
    def nbytes(self) -> int:
        """Bytes of memory."""
        return self.difference.scales.nbytes + self.difference.values.nbytes

    def part(self, number: int) -> ParametersDelta:
        """Return a part that there is."""
        start, stop = number * ParametersDelta.LENGTH, (number + 1) * ParametersDelta.LENGTH
        scales = self.difference.scales[start // BLOCK : stop // BLOCK]
        return ParametersDelta(self.head, self.base, self.renews, number, scales, self.difference.values[start:stop])


Edition = Full | Delta
