"""Which base the newest parameters are served as the difference to, and how a reader comes to have it."""

from typing import Final, NamedTuple

from hoz_dist.wire.protocol.deltas import add, quantise
from hoz_dist.wire.protocol.parameters import digest_of
from hoz_dist.wire.serving.editions import Delta, Edition, Full
from hoz_dist.wire.transport.buffers import Buffers

LONGEST_LIFE: Final = 256
"""Versions after which a base is replaced. Adam moves a parameter by about its learning rate at most in each, and a
delta is off by at most a 254th of the largest movement of its block: by no more than one version's."""


class _Base(NamedTuple):
    edition: Full
    digest: str


class Bases:
    """The base and the differences to it; used by one thread.

    Nothing is done before somebody asks, and each version is quantised at most once. Errors do not add up: what a delta
    makes of the old base, error included, is the new one, and later versions are compared with that. So a reader of
    the old base needs no more than a delta to have the new one, and only a new reader fetches a base in full.

    Args:
        buffers: Where the memory of bases comes from.
    """

    def __init__(self, buffers: Buffers) -> None:
        self._buffers = buffers
        self._base: _Base | None = None
        self._link: Delta | None = None
        """From the base before to the base."""
        self._newest: Delta | None = None
        """From the base to the newest version that was asked for."""

    @property
    def kept(self) -> tuple[Edition, ...]:
        """What is kept whether somebody reads it or not."""
        base = self._base.edition if self._base is not None else None
        return tuple(one for one in (base, self._link, self._newest) if one is not None)

    def next_for(self, held: str, newest: Full) -> Edition | None:
        """Return what brings a reader nearer to the newest version; None when its base is that version.

        Args:
            held: Digest of the base that it has; any other text for none.
            newest: The newest version.
        """
        base = self._base
        if base is None or not _follows(newest, base.edition):
            base = self._base = _Base(newest, digest_of(newest.vector))
            self._link = self._newest = None
        if held == base.digest:
            return None if newest.head.stamp == base.edition.head.stamp else self._delta(base, newest)
        if self._link is not None and held == self._link.base:
            return self._link
        return base.edition

    def _delta(self, base: _Base, newest: Full) -> Delta:
        """Return the newest version as the difference to the base; an old base is replaced."""
        if self._newest is not None and self._newest.head.stamp == newest.head.stamp:
            return self._newest
        old = newest.head.version - base.edition.head.version >= LONGEST_LIFE
        difference = quantise(newest.vector, base.edition.vector)
        delta = Delta(newest.head, base.digest, old, difference)
        if old:
            vector = self._buffers.empty(newest.head.size)
            add(base.edition.vector, difference, vector)
            vector.flags.writeable = False
            self._base = _Base(Full(newest.head, vector), digest_of(vector))
            self._link, self._newest = delta, None
        else:
            self._newest = delta
        return delta


def _follows(newest: Full, base: Full) -> bool:
    """Tell whether a version is of the same parameters as a base, and not before it."""
    one, other = newest.head, base.head
    return one.epoch == other.epoch and one.size == other.size and one.version >= other.version
