"""Serves parameters: a small head is published, the bulk is given out in shards, one after the other.

The version that somebody is reading is kept, so that a fetch never mixes two, however fast the learner is. One shard at
a time is under way to each reader, and fits the sending queue of its link: who reads slowly, or stands still, holds up
nobody else.
"""

import time
from typing import Final

import numpy as np
from numpy.typing import NDArray
from zenoh import KeyExpr, Query, Session

from hoz_dist.closing import Closing
from hoz_dist.stages import StageClock
from hoz_dist.wire.protocol.answers import Busy
from hoz_dist.wire.protocol.keys import NAME_PATTERN, Keys
from hoz_dist.wire.protocol.message import SHARD_ELEMENTS, Message
from hoz_dist.wire.protocol.parameters import Parameters, ParametersHead, ParametersShard, head_of
from hoz_dist.wire.protocol.rejection import Reason, RejectedError, shown
from hoz_dist.wire.protocol.rejections import Rejections
from hoz_dist.wire.serving.versions import Versions
from hoz_dist.wire.transport.publishing import NewestPublisher
from hoz_dist.wire.transport.queryable import answer, check_question, declare_queryable, parameters_of, refuse
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
        self._clock = clock or StageClock()
        self._memory = memory
        self._rejections = rejections or Rejections()
        self._versions = versions or Versions()
        self._publisher = NewestPublisher(session, keys.params)
        self._queryable = declare_queryable(session, keys.all_params, self._measured, rejections=self._rejections)

    def publish(self, epoch: int, version: int, vector: NDArray[np.float32]) -> ParametersHead:
        """Make a version the newest one.

        Args:
            epoch: Epoch of the learner.
            version: Version of the parameters; never falls within an epoch.
            vector: [P] f32; copied, so that the learner may go on with its own.
        """
        copy = np.array(vector, "<f4")
        copy.flags.writeable = False
        head = head_of(epoch, version, copy)
        self._versions.newest = Parameters(head, copy)
        self._publisher.publish(head)
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
            if query.key_expr.intersects(KeyExpr(self._keys.params)):
                key, memory = self._keys.params, None
                reply: Message = newest.head
            else:
                key, memory = str(query.key_expr), self._memory
                reply = self._shard(key.removeprefix(self._keys.params + "/"), parameters_of(query)) or Busy(epoch)
        except RejectedError as error:
            refuse(query, error, epoch, self._rejections)
        else:
            answer(query, key, reply, memory)

    def _shard(self, name: str, asked: dict[str, str]) -> ParametersShard | None:
        """Return the shard that is asked for; None when one more version cannot be kept now.

        Args:
            name: Number of the shard, the last part of the key.
            asked: ``reader``: who asks; ``epoch`` and ``version``: of what; for shard 0 the newest when not given.

        Raises:
            RejectedError: The version is gone, there is no such shard, or the question cannot be understood.
        """
        number, reader, now = _number("the shard", name), asked.get("reader", ""), time.monotonic()
        if not NAME_PATTERN.fullmatch(reader):
            raise RejectedError(Reason.NAME, f"the reader's name is not well formed: {shown(reader)}")
        if "version" in asked:
            stamp = (_number("the epoch", asked.get("epoch", "")), _number("the version", asked["version"]))
            parameters = self._versions.go_on(reader, stamp, number, now)
            if parameters is None:
                raise RejectedError(Reason.GONE, f"version {stamp[1]} of epoch {stamp[0]} is not kept any more")
        elif number > 0:
            raise RejectedError(Reason.RANGE, f"shard {number} of no version was asked for; only 0 is the newest's")
        else:
            begun = self._versions.begin(reader, now)
            if begun is None:
                return None
            parameters = begun
        head = parameters.head
        if number >= head.shards:
            raise RejectedError(Reason.RANGE, f"shard {number} was asked for, and there are {head.shards}")
        if number == head.shards - 1:
            self._versions.end(reader)
        start = number * SHARD_ELEMENTS
        return ParametersShard(head, number, parameters.vector[start : start + SHARD_ELEMENTS])


def _number(what: str, text: str) -> int:
    """Return the number that a part of a question is.

    Raises:
        RejectedError: It is none.
    """
    if not (text.isascii() and text.isdigit() and len(text) <= _LONGEST_NUMBER):
        raise RejectedError(Reason.MALFORMED, f"{what} is no number: {shown(text)}")
    return int(text)
