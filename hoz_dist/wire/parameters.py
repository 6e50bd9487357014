"""Parameters: a small head is published, the bulk is fetched in shards.

One query for all shards is answered from one version, so that a fetch never mixes two, however fast the learner is.
"""

import logging
import threading
from typing import Final, NamedTuple

import numpy as np
import xxhash
from numpy.typing import NDArray
from zenoh import KeyExpr, Query, Session

from hoz_dist.closing import Closing
from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.ask import Answer, ask
from hoz_dist.wire.codec import decode, encode
from hoz_dist.wire.keys import Keys
from hoz_dist.wire.messages import ParametersHead, ParametersShard
from hoz_dist.wire.outage import learner_outage
from hoz_dist.wire.publishing import NewestPublisher, NewestSubscriber
from hoz_dist.wire.queryable import declare_queryable
from hoz_dist.wire.rejection import Reason, RejectedError
from hoz_dist.wire.waiting import Backoff, Deadline

_log = logging.getLogger(__name__)
SHARD_ELEMENTS: Final = 2 * 1024 * 1024
"""Elements of a full shard; 8 MiB."""
_ATTEMPT_S: Final = 10.0


class Parameters(NamedTuple):
    """A version of the parameters."""

    head: ParametersHead
    vector: NDArray[np.float32]
    """[P], read-only."""


def head_of(epoch: int, version: int, vector: NDArray[np.float32]) -> ParametersHead:
    """Return the head of a parameter vector [P]."""
    digest = xxhash.xxh3_64_hexdigest(vector.data)
    return ParametersHead(epoch, version, digest, len(vector), -(-len(vector) // SHARD_ELEMENTS))


class ParametersPublisher(Closing):
    """Publishes the head of the newest parameters and serves their shards.

    Args:
        session: Session of the learner.
        keys: Keys of the run.
    """

    def __init__(self, session: Session, keys: Keys) -> None:
        self._keys = keys
        self._newest: Parameters | None = None
        self._publisher = NewestPublisher(session, keys.params)
        self._queryable = declare_queryable(session, f"{keys.params}/**", self._answer)

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
        self._newest = Parameters(head, copy)
        self._publisher.publish(head)
        return head

    def close(self) -> None:
        """Stop publishing and serving."""
        self._queryable.close()
        self._publisher.close()

    def _answer(self, query: Query) -> None:
        """Reply with the head, or with all shards that the query selects."""
        newest = self._newest
        with query:
            if newest is None:
                return
            if query.key_expr.intersects(KeyExpr(self._keys.params)):
                query.reply(self._keys.params, encode(newest.head))
            for shard in range(newest.head.shards):
                key = self._keys.shard(shard)
                if query.key_expr.intersects(KeyExpr(key)):
                    values = newest.vector[shard * SHARD_ELEMENTS : (shard + 1) * SHARD_ELEMENTS]
                    query.reply(key, encode(ParametersShard(newest.head, shard, values)))


class ParametersFollower(Closing):
    """Knows the newest head and fetches parameters; they never run backwards.

    Args:
        session: Session of the actor.
        keys: Keys of the run.
        stop: Ends a fetch that waits.
    """

    def __init__(self, session: Session, keys: Keys, stop: threading.Event) -> None:
        self._session = session
        self._keys = keys
        self._stop = stop
        self._fetched: Parameters | None = None
        self._outage = learner_outage(_log)
        self._subscriber = NewestSubscriber(
            session, keys.params, ParametersHead, replaces=lambda known, new: new.stamp >= known.stamp
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
            timeout_s: When to give up, seconds from now; None for never.

        Raises:
            StoppedError: The stop event was set.
            ConnectionFailedError: The learner did not serve them in time.
        """
        if at_least is not None and self._fetched is not None and self._is_newest(self._fetched, at_least):
            return self._fetched
        wanted = max(at_least or (0, 0), self._fetched.head.stamp if self._fetched else (0, 0))
        deadline, backoff = Deadline(timeout_s), Backoff(self._stop)
        while True:
            answers = ask(self._session, self._keys.shards, timeout_s=deadline.within(_ATTEMPT_S), stop=self._stop)
            if answers:
                self._outage.worked()
            else:
                self._outage.failed()
            try:
                fetched = assemble(answers)
            except RejectedError as error:
                _log.warning("fetched parameters that cannot be used: %s", error)
                fetched = None
            if fetched is not None and fetched.head.stamp >= wanted:
                self._fetched = fetched
                return fetched
            if deadline.passed:
                message = (
                    f"The learner did not serve parameters of version {wanted[1]} or later within {timeout_s:g} s."
                )
                raise ConnectionFailedError(message)
            backoff.pause(deadline)

    def _is_newest(self, fetched: Parameters, at_least: tuple[int, int]) -> bool:
        """Tell whether parameters that were fetched suffice, and are the last that were heard of."""
        return self.newest is not None and self.newest.stamp == fetched.head.stamp >= at_least

    def close(self) -> None:
        """Stop following."""
        self._subscriber.close()


def assemble(answers: list[Answer]) -> Parameters | None:
    """Join the shards of one answer; None when some are missing.

    Raises:
        RejectedError: A shard is damaged, or together they do not have the digest of their head.
    """
    shards = {shard.shard: shard for shard in (decode(answer.payload, ParametersShard) for answer in answers)}
    heads = {(shard.head.stamp, shard.head.digest) for shard in shards.values()}
    head = shards[0].head if 0 in shards else None
    if head is None or len(heads) > 1 or shards.keys() != set(range(head.shards)):
        return None
    vector = (
        np.concatenate([shards[index].values for index in range(head.shards)]) if head.shards > 1 else shards[0].values
    )
    if head_of(*head.stamp, vector).digest != head.digest or len(vector) != head.size:
        raise RejectedError(Reason.DIGEST, "the parameters do not have the digest of their head")
    vector.flags.writeable = False
    return Parameters(head, vector)
