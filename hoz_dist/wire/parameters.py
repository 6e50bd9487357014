"""Parameters: a small head is published, the bulk is fetched in shards, one after the other.

The learner keeps the version that somebody is reading, so that a fetch never mixes two, however fast the learner is.
One shard at a time is under way to each reader, and fits the sending queue of its link: who reads slowly, or stands
still, holds up nobody else.
"""

import logging
import secrets
import threading
import time
from typing import Final

import numpy as np
import xxhash
from numpy.typing import NDArray
from zenoh import KeyExpr, Query, Session

from hoz_dist.closing import Closing
from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.asking import Asking
from hoz_dist.wire.download import Download
from hoz_dist.wire.epochs import AnotherRunError, Epochs
from hoz_dist.wire.keys import NAME_PATTERN, NOBODY, Keys
from hoz_dist.wire.message import SHARD_ELEMENTS
from hoz_dist.wire.messages import Busy, ParametersHead, ParametersShard, Refused
from hoz_dist.wire.publishing import NewestPublisher, NewestSubscriber
from hoz_dist.wire.queryable import answer, declare_queryable, parameters_of
from hoz_dist.wire.rejection import Reason, RejectedError
from hoz_dist.wire.rejections import Rejections
from hoz_dist.wire.shared_memory import SharedMemory
from hoz_dist.wire.versions import Parameters, Versions
from hoz_dist.wire.waiting import Backoff, Deadline

__all__ = ["Parameters", "ParametersFollower", "ParametersPublisher", "head_of"]

_log = logging.getLogger(__name__)
_LONGEST_NUMBER: Final = 18
"""Digits of numbers in questions; no more than 2^63 - 1."""


def head_of(epoch: int, version: int, vector: NDArray[np.float32]) -> ParametersHead:
    """Return the head of a parameter vector [P]."""
    digest = xxhash.xxh3_64_hexdigest(vector.data)
    return ParametersHead(epoch, version, digest, len(vector), -(-len(vector) // SHARD_ELEMENTS))


class ParametersPublisher(Closing):
    """Publishes the head of the newest parameters and serves shards.

    Args:
        session: Session of the learner.
        keys: Keys of the run.
        rejections: Where questions that cannot be understood are counted.
        versions: What is kept for readers.
        memory: Shared memory for the shards; None for none.
    """

    def __init__(
        self,
        session: Session,
        keys: Keys,
        rejections: Rejections | None = None,
        versions: Versions | None = None,
        memory: SharedMemory | None = None,
    ) -> None:
        self._keys = keys
        self._memory = memory
        self._rejections = rejections or Rejections()
        self._versions = versions or Versions()
        self._publisher = NewestPublisher(session, keys.params)
        self._queryable = declare_queryable(session, keys.all_params, self._answer)

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

    def _answer(self, query: Query) -> None:
        """Reply with the head or with one shard."""
        newest = self._versions.newest
        if newest is None:
            query.drop()  # type: ignore[no-untyped-call]
        elif query.key_expr.intersects(KeyExpr(self._keys.params)):
            answer(query, self._keys.params, newest.head)
        else:
            self._answer_shard(query, newest.head)

    def _answer_shard(self, query: Query, newest: ParametersHead) -> None:
        key = str(query.key_expr)
        try:
            reply = self._shard(key.removeprefix(self._keys.params + "/"), parameters_of(query))
        except RejectedError as error:
            if error.reason != Reason.GONE:
                self._rejections.count(error.reason, error.detail, NOBODY)
            answer(query, key, Refused.of(error, newest.epoch))
        else:
            answer(query, key, reply or Busy(newest.epoch), self._memory)

    def _shard(self, name: str, asked: dict[str, str]) -> ParametersShard | None:
        """Return the shard that is asked for; None when one more version cannot be kept now.

        Args:
            name: Number of the shard, the last part of the key.
            asked: ``reader``: who asks; ``epoch`` and ``version``: of what, the newest when not given.

        Raises:
            RejectedError: The version is gone, or the question cannot be understood.
        """
        number, reader, now = _number("the shard", name), asked.get("reader", ""), time.monotonic()
        if not NAME_PATTERN.fullmatch(reader):
            raise RejectedError(Reason.NAME, f"the reader's name is not well formed: {reader!r:.80}")
        if "version" in asked:
            stamp = (_number("the epoch", asked.get("epoch", "")), _number("the version", asked["version"]))
            parameters = self._versions.go_on(reader, stamp, now)
            if parameters is None:
                raise RejectedError(Reason.GONE, f"version {stamp[1]} of epoch {stamp[0]} is not kept any more")
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


class ParametersFollower(Closing):
    """Knows the newest head and fetches parameters; they never run backwards.

    Args:
        session: Session of the actor.
        keys: Keys of the run.
        stop: Ends a fetch that waits.
        epochs: What is known of the learner's epochs; parameters of a lower one do not count.
    """

    def __init__(self, session: Session, keys: Keys, stop: threading.Event, epochs: Epochs | None = None) -> None:
        self._keys = keys
        self._stop = stop
        known = epochs or Epochs()
        self._asking = Asking(session, stop, known)
        self._reader = f"r{secrets.token_hex(8)}"
        self._fetched: Parameters | None = None
        self._subscriber = NewestSubscriber(
            session,
            keys.params,
            ParametersHead,
            key_of=lambda _: keys.params,
            replaces=lambda old, new: new.stamp >= old.stamp,
            heard=lambda head: known.hear(head.epoch),
        )

    @property
    def newest(self) -> ParametersHead | None:
        """The newest head that was heard of."""
        return self._subscriber.newest.get(self._keys.params)

    def fetch(self, at_least: tuple[int, int] | None = None, timeout_s: float | None = None) -> Parameters:
        """Return the newest parameters.

        Those that were fetched last are returned without asking when they suffice and no newer ones were heard of.

        Args:
            at_least: Epoch and version that they must have reached; None to ask for the newest in any case.
            timeout_s: When to give up after the last shard that came, seconds; None for never.

        Raises:
            StoppedError: The stop event was set.
            ConnectionFailedError: The learner did not serve them in time.
            OtherVersionError: The learner speaks another version of the protocol.
            AnotherRunError: The learner has begun another run.
        """
        if at_least is not None and self._fetched is not None and self._is_newest(self._fetched, at_least):
            return self._fetched
        wanted = max(at_least or (0, 0), self._fetched.head.stamp if self._fetched else (0, 0))
        download = Download()
        deadline, backoff = Deadline(timeout_s), Backoff(self._stop)
        while True:
            reply = self._asking.once(self._selector(download), deadline, ParametersShard, Busy, Refused)
            if isinstance(reply, ParametersShard) and self._is_late_enough(reply.head, wanted) and download.add(reply):
                if (fetched := _whole(download)) is not None:
                    self._fetched = fetched
                    return fetched
                deadline, backoff = Deadline(timeout_s), Backoff(self._stop)
                continue
            if isinstance(reply, ParametersShard | Refused):
                download.begin_again()  # the version is gone; or another learner answers
            if deadline.passed:
                message = f"The learner did not serve parameters of version {wanted[1]} or later in {timeout_s:g} s."
                raise ConnectionFailedError(message)
            backoff.pause(deadline)

    def _selector(self, download: Download) -> str:
        """Ask for the first shard of the newest version, or for the next one of the version that it was."""
        selector = f"{self._keys.shard(download.next)}?reader={self._reader}"
        head = download.head
        return selector if head is None else f"{selector};epoch={head.epoch};version={head.version}"

    def _is_late_enough(self, head: ParametersHead, wanted: tuple[int, int]) -> bool:
        """Tell whether a version will do.

        Raises:
            AnotherRunError: The learner went back behind what it served before in the same epoch.
        """
        known = self._fetched.head if self._fetched is not None else None
        if known is not None and known.epoch == head.epoch and head.version < known.version:
            message = (
                f"The learner has begun another run: it serves version {head.version} of epoch {head.epoch} and has "
                f"served version {known.version}; start this process again."
            )
            raise AnotherRunError(message)
        return head.stamp >= wanted

    def _is_newest(self, fetched: Parameters, at_least: tuple[int, int]) -> bool:
        """Tell whether parameters that were fetched suffice, and are the last that were heard of."""
        return self.newest is not None and self.newest.stamp == fetched.head.stamp >= at_least

    def close(self) -> None:
        """Stop following."""
        self._subscriber.close()


def _whole(download: Download) -> Parameters | None:
    """Return the parameters when all shards have come; should they be damaged, they are dropped."""
    try:
        return download.result()
    except RejectedError as error:
        _log.warning("fetched parameters that cannot be used: %s", error)
        download.begin_again()
        return None


def _number(what: str, text: str) -> int:
    """Return the number that a part of a question is.

    Raises:
        RejectedError: It is none.
    """
    if not (text.isascii() and text.isdigit() and len(text) <= _LONGEST_NUMBER):
        raise RejectedError(Reason.MALFORMED, f"{what} is no number: {text!r:.80}")
    return int(text)
