"""Which base the newest parameters are served as the difference to, and how a reader comes to have it."""

import threading
from typing import Final, NamedTuple

from hoz_dist.wire.protocol.deltas import add, quantise
from hoz_dist.wire.protocol.parameters import ParametersHead, digest_of
from hoz_dist.wire.serving.editions import Delta, Edition, Full
from hoz_dist.wire.transport.buffers import Buffers

LONGEST_LIFE: Final = 256
"""A base is replaced at each multiple of this. Adam moves a parameter by about its learning rate at most in a version,
and a delta is off by at most a 254th of the largest movement of its block: by no more than one version's."""


class _Base(NamedTuple):
    edition: Full
    digest: str


class Bases:
    """The base and the differences to it; may be used from several threads.

    Nothing is done before somebody asks for the first time, and each version is quantised at most once. Errors do not
    add up: what a delta makes of the old base, error included, is the new one, and later versions are compared with
    that. So a reader of the old base needs no more than a delta to have the new one, and only a new reader fetches a
    base in full.

    What a reader makes of a version does not depend on when anybody asks: the first base is the version that actors
    begin with, and the others follow by the number of the version. So a run can be repeated to the bit.

    Args:
        buffers: Where the memory of bases comes from.
    """

    def __init__(self, buffers: Buffers) -> None:
        self._buffers = buffers
        self._lock = threading.Lock()
        self._published: Full | None = None
        self._base: _Base | None = None
        self._link: Delta | None = None
        """From the base before to the base."""
        self._newest: Delta | None = None
        """From the base to the newest version that was asked for."""

    @property
    def kept(self) -> tuple[Edition, ...]:
        """What is kept whether somebody reads it or not."""
        with self._lock:
            base = self._base.edition if self._base is not None else None
            return tuple(one for one in (base, self._link, self._newest) if one is not None)

    def publish(self, newest: Full) -> None:
        """Make a version the newest one; the first one from a multiple of `LONGEST_LIFE` on becomes the base."""
        with self._lock:
            self._published = newest
            base = self._base
            if base is None:
                return
            if not _follows(newest, base.edition):
                self._base = self._link = self._newest = None
            elif newest.head.version // LONGEST_LIFE > base.edition.head.version // LONGEST_LIFE:
                self._renew(base, newest)

    def next_for(self, held: str) -> Edition | ParametersHead | None:
        """Return what brings a reader nearer to the newest version.

        Args:
            held: Digest of the base that it has; any other text for none.

        Returns:
            The head of the newest version when its base is that one; None before a version is published.
        """
        with self._lock:
            newest, base = self._published, self._base
            if newest is None:
                return None
            if base is None:
                base = self._base = _Base(newest, digest_of(newest.vector))
            if held != base.digest:
                return self._link if self._link is not None and held == self._link.base else base.edition
            if newest.head.stamp == base.edition.head.stamp:
                return newest.head
            if self._newest is not None and self._newest.head.stamp == newest.head.stamp:
                return self._newest
        # Without the lock: the learner need not wait until this is done.
        difference = quantise(newest.vector, base.edition.vector)
        delta = Delta(newest.head, base.digest, renews=False, difference=difference)
        with self._lock:
            if self._base is base:
                self._newest = delta
        return delta

    def _renew(self, base: _Base, newest: Full) -> None:
        """Replace the base by what a delta makes of it."""
        difference = quantise(newest.vector, base.edition.vector)
        vector = self._buffers.empty(newest.head.size)
        add(base.edition.vector, difference, vector)
        vector.flags.writeable = False
        self._base = _Base(Full(newest.head, vector), digest_of(vector))
        self._link = Delta(newest.head, base.digest, renews=True, difference=difference)
        self._newest = None


def _follows(newest: Full, base: Full) -> bool:
    """Tell whether a version is of the same parameters as a base, and not before it."""
    one, other = newest.head, base.head
    return one.epoch == other.epoch and one.size == other.size and one.version >= other.version
