"""A version of the parameters that arrives in shards."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hoz_dist.wire.protocol.deltas import Quantised, add
from hoz_dist.wire.protocol.parameters import (
    Parameters,
    ParametersDelta,
    ParametersHead,
    Part,
    digest_of,
    shards_of,
)
from hoz_dist.wire.transport.buffers import Buffers


class Base(NamedTuple):
    """Parameters that others are the difference to."""

    parameters: Parameters
    digest: str


class Download:
    """The parts that have come so far, all of one version and kind, and in order.

    Args:
        buffers: Where the memory of the vector comes from.
        base: What the reader has that deltas may be the difference to.

    Attributes:
        head: Head of the version; None before the first part.
        next: Number of the next part.
        shards: Number of parts; 1 while that is not known.
        renews: Whether the version is a base. Who asks for deltas and gets a version in full gets a base.
    """

    head: ParametersHead | None
    next: int
    shards: int
    renews: bool

    def __init__(self, buffers: Buffers, base: Base | None = None) -> None:
        self._buffers = buffers
        self._base = base
        self.begin_again()

    def begin_again(self) -> None:
        """Drop what has come."""
        self.head = None
        self.next = 0
        self.shards = 1
        self.renews = True
        self._kind: type[Part] | None = None
        self._vector: NDArray[np.float32] | None = None

    def add(self, part: Part) -> bool:
        """Take the next part; False, and nothing is changed, when it is another one, or of something else."""
        if part.shard != self.next or not self._fits(part):
            return False
        if self._vector is None:
            self.head, self._kind = part.head, type(part)
            self.shards = shards_of(part.head.size, type(part))
            self.renews = not isinstance(part, ParametersDelta) or part.renews
            self._vector = self._buffers.empty(part.head.size)
        start = part.shard * part.LENGTH
        place = self._vector[start : start + part.values.size]
        if isinstance(part, ParametersDelta):
            assert self._base is not None  # noqa: S101 - it fits
            base = self._base.parameters.vector[start : start + part.values.size]
            add(base, Quantised(part.scales, part.values), place)
        else:
            place[:] = part.values
        self.next += 1
        return True

    def result(self) -> Parameters | None:
        """Return the parameters; None while parts are missing."""
        if self.head is None or self._vector is None or self.next < self.shards:
            return None
        self._vector.flags.writeable = False
        return Parameters(self.head, self._vector)

    def _fits(self, part: Part) -> bool:
        """Tell whether a part is of what has come so far, and can be used."""
        if isinstance(part, ParametersDelta):
            base = self._base
            if base is None or part.base != base.digest or part.head.size != base.parameters.head.size:
                return False
        if self.head is None:
            return True
        same_head = (part.head.stamp, part.head.size) == (self.head.stamp, self.head.size)
        return same_head and type(part) is self._kind


def base_of(parameters: Parameters) -> Base:
    """Return parameters as a base."""
    return Base(parameters, digest_of(parameters.vector))
