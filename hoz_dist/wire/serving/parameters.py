"""Serves parameters: a small head is published, the bulk is given out in shards.

The version that somebody is reading is kept, so that a fetch never mixes two, however fast the learner is. Few shards
at a time are under way to each reader, and fit the sending queue of its link: who reads slowly, or stands still, holds
up nobody else. Whoever wants it gets the difference to a base that it has, in a quarter of the bytes.
"""

import time
from typing import Final

import numpy as np
from numpy.typing import NDArray
from zenoh import KeyExpr, Query, Session

from hoz_dist.closing import Closing
from hoz_dist.stages import StageClock
from hoz_dist.wire.protocol.answers import Busy
from hoz_dist.wire.protocol.codec import encode, lay_out
from hoz_dist.wire.protocol.keys import NAME_PATTERN, Keys
from hoz_dist.wire.protocol.message import DIGEST
from hoz_dist.wire.protocol.parameters import NO_BASE, ParametersHead, Part
from hoz_dist.wire.protocol.rejection import Reason, RejectedError, shown
from hoz_dist.wire.protocol.rejections import Rejections
from hoz_dist.wire.serving.bases import Bases
from hoz_dist.wire.serving.editions import Edition, Full
from hoz_dist.wire.serving.versions import Versions
from hoz_dist.wire.transport.buffers import Buffers
from hoz_dist.wire.transport.outgoing import Outgoing
from hoz_dist.wire.transport.publishing import NewestPublisher
from hoz_dist.wire.transport.queryable import (
    answer,
    check_question,
    declare_queryable,
    parameters_of,
    refuse,
    reply,
)
from hoz_dist.wire.transport.shared_memory import SharedMemory

_LONGEST_NUMBER: Final = 18
"""Digits of numbers in questions; no more than 2^63 - 1."""


class ParametersPublisher(Closing):
    """Publishes the head of the newest parameters and serves shards.

    Args:
        session: Session of the learner.
        keys: Keys of the run.
        rejections: Where questions that cannot be understood are counted.
        versions: What is kept for readers.
        memory: Shared memory for the shards; None for none.
        clock: Measures how long answering takes, as the stage ``serve``.
    """

    def __init__(
        self,
        session: Session,
        keys: Keys,
        rejections: Rejections | None = None,
        versions: Versions | None = None,
        memory: SharedMemory | None = None,
        clock: StageClock | None = None,
    ) -> None:
        self._keys = keys
        self._head_key = KeyExpr(keys.params)
        self._clock = clock or StageClock()
        self._outgoing = Outgoing(memory or SharedMemory(on=False))
        self._rejections = rejections or Rejections()
        self._versions = versions or Versions()
        self._buffers = Buffers()
        self._bases = Bases(self._buffers)
        self._publisher = NewestPublisher(session, keys.params)
        self._queryable = declare_queryable(session, keys.all_params, self._measured, rejections=self._rejections)

    def publish(self, epoch: int, version: int, vector: NDArray[np.float32]) -> ParametersHead:
        """Make a version the newest one.

        Args:
            epoch: Epoch of the learner.
            version: Version of the parameters; never falls within an epoch.
            vector: [P] f32; copied, so that the learner may go on with its own.
        """
        head = ParametersHead(epoch, version, vector.size)
        newest = Full(head, self._buffers.copy(vector))
        self._bases.publish(newest)
        self._versions.newest = newest
        self._publisher.publish(encode(head))
        return head

    def close(self) -> None:
        """Stop publishing and serving."""
        self._queryable.close()
        self._publisher.close()

    def _measured(self, query: Query) -> None:
        with self._clock("serve"):
            self._answer(query)

    def _answer(self, query: Query) -> None:
        """Reply with the head or with one shard."""
        newest = self._versions.newest
        if newest is None:
            query.drop()  # type: ignore[no-untyped-call]
            return
        epoch = newest.head.epoch
        try:
            check_question(query)
            if query.key_expr.intersects(self._head_key):
                answer(query, self._keys.params, newest.head)
                return
            key = str(query.key_expr)
            part = self._part(key.removeprefix(self._keys.params + "/"), parameters_of(query), newest)
        except RejectedError as error:
            refuse(query, error, epoch, self._rejections)
            return
        if part is None:
            answer(query, key, Busy(epoch))
        else:
            data, checksum = self._outgoing.payload(lay_out(part))
            reply(query, key, data, checksum)

    def _part(self, name: str, asked: dict[str, str], newest: Full) -> Part | ParametersHead | None:
        """Return the part that is asked for, or the head of what the reader has; None when no more can be kept now.

        Args:
            name: Number of the shard, the last part of the key.
            asked: ``reader``: who asks; ``epoch`` and ``version``: of what, unless for the first shard; ``base``: from
                who wants deltas, the digest of the base that it has, or ``none``.
            newest: The newest version.

        Raises:
            RejectedError: The version is gone, there is no such shard, or the question cannot be understood.
        """
        number, reader, base = _number("the shard", name), asked.get("reader", ""), asked.get("base")
        if not NAME_PATTERN.fullmatch(reader):
            raise RejectedError(Reason.NAME, f"the reader's name is not well formed: {shown(reader)}")
        if base is not None and base != NO_BASE:
            DIGEST.check(base, "the base")
        now = time.monotonic()
        if "version" in asked:
            stamp = (_number("the epoch", asked.get("epoch", "")), _number("the version", asked["version"]))
            edition = self._versions.go_on(reader, stamp, number, now, deltas=base is not None)
            if edition is None:
                raise RejectedError(Reason.GONE, f"version {stamp[1]} of epoch {stamp[0]} is not kept any more")
        elif number > 0:
            raise RejectedError(Reason.RANGE, f"shard {number} of no version was asked for; only 0 is the newest's")
        else:
            following = newest if base is None else self._next_for(base)
            if following is None or isinstance(following, ParametersHead):
                return following
            edition = following
            if not self._versions.begin(reader, edition, now):
                return None
        if number >= edition.shards:
            raise RejectedError(Reason.RANGE, f"shard {number} was asked for, and there are {edition.shards}")
        return edition.part(number)

    def _next_for(self, base: str) -> Edition | ParametersHead | None:
        """Return what a reader of deltas needs; see `Bases.next_for`."""
        edition = self._bases.next_for(base)
        self._versions.besides = self._bases.kept
        return edition


def _number(what: str, text: str) -> int:
    """Return the number that a part of a question is.

    Raises:
        RejectedError: It is none.
    """
    if not (text.isascii() and text.isdigit() and len(text) <= _LONGEST_NUMBER):
        raise RejectedError(Reason.MALFORMED, f"{what} is no number: {shown(text)}")
    return int(text)
