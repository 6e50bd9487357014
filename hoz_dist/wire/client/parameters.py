"""Fetches parameters: follows the small heads that are published, and asks for the bulk shard by shard."""

import secrets
import threading
import time
from collections import deque
from typing import Final

from zenoh import Session

from hoz_dist.closing import Closing
from hoz_dist.errors import ConnectionFailedError
from hoz_dist.waiting import Backoff, Deadline
from hoz_dist.wire.client.asking import Asking
from hoz_dist.wire.client.download import Base, Download, base_of
from hoz_dist.wire.client.epochs import AnotherRunError, Epochs
from hoz_dist.wire.protocol.answers import Busy, Refused
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.parameters import (
    NO_BASE,
    Parameters,
    ParametersDelta,
    ParametersHead,
    ParametersShard,
)
from hoz_dist.wire.transport.ask import Question
from hoz_dist.wire.transport.buffers import Buffers
from hoz_dist.wire.transport.publishing import NewestSubscriber

MOST_UNDER_WAY: Final = 2
"""Shards that are under way at once over a fast link; so many fit into the queue of a link that stands still."""
FAST_S: Final = 0.05
"""Over a link that takes longer for a shard, one is under way at a time."""


class ParametersFollower(Closing):
    """Knows the newest head and fetches parameters; they never run backwards.

    Args:
        session: Session of the actor.
        keys: Keys of the run.
        stop: Ends a fetch that waits.
        epochs: What is known of the learner's epochs; parameters of a lower one do not count.
        deltas: Whether to fetch the difference to a base, which is fetched once.
    """

    def __init__(
        self,
        session: Session,
        keys: Keys,
        stop: threading.Event,
        epochs: Epochs | None = None,
        *,
        deltas: bool = False,
    ) -> None:
        self._keys = keys
        self._stop = stop
        known = epochs or Epochs()
        self._asking = Asking(session, stop, known)
        self._reader = f"r{secrets.token_hex(8)}"
        self._buffers = Buffers()
        self._deltas = deltas
        self._base: Base | None = None
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
            timeout_s: When to give up after the last shard that came, or after a base that is older, seconds; None for
                never.

        Raises:
            StoppedError: The stop event was set.
            ConnectionFailedError: The learner did not serve them in time.
            OtherVersionError: The learner speaks another version of the protocol.
            AnotherRunError: The learner has begun another run.
        """
        if at_least is not None and self._fetched is not None and self._is_newest(self._fetched, at_least):
            return self._fetched
        wanted = max(at_least or (0, 0), self._fetched.head.stamp if self._fetched else (0, 0))
        deadline, went_further = Deadline(timeout_s), False
        while True:
            fetched, is_base = self._newest_or_base(wanted, timeout_s)
            if fetched.head.stamp >= wanted:
                # A base may be hundreds of versions old, and the newest is a delta away. But a learner that is faster
                # than the link is always a version further: one more round is enough.
                if not is_base or went_further or deadline.passed or self._is_newest(fetched, wanted):
                    self._fetched = fetched
                    return fetched
                went_further = True
            elif deadline.passed:
                raise _not_served(wanted, timeout_s)

    def _newest_or_base(self, wanted: tuple[int, int], timeout_s: float | None) -> tuple[Parameters, bool]:
        """Fetch the newest parameters, or the base that is needed for that, and tell whether they are a base.

        Args:
            wanted: Epoch and version that they must have reached; a base need not.
            timeout_s: When to give up after the last shard that came, seconds; None for never.

        Raises:
            StoppedError: The stop event was set.
            HozError: See `fetch`.
        """
        download = Download(self._buffers, self._base)
        under_way: deque[Question] = deque()
        window = 1
        deadline, backoff = Deadline(timeout_s), Backoff(self._stop)
        while True:
            while len(under_way) < window and download.next + len(under_way) < download.shards:
                selector = self._selector(download, download.next + len(under_way))
                under_way.append(self._asking.begin(selector, deadline))
            question = under_way.popleft()
            reply = self._asking.finish(question, ParametersShard, ParametersDelta, ParametersHead, Busy, Refused)
            if isinstance(reply, ParametersHead) and self._base is not None and self._is_late_enough(reply, wanted):
                # Of this version the base is; though perhaps it was fetched as that of another learner.
                self._base = Base(Parameters(reply, self._base.parameters.vector), self._base.digest)
                return self._base.parameters, False
            if isinstance(reply, ParametersShard | ParametersDelta):
                of_use = self._is_late_enough(reply.head, wanted) or self._is_base(reply)
                if of_use and download.add(reply):
                    if (parameters := download.result()) is not None:
                        is_base = self._deltas and download.renews
                        if is_base:
                            self._base = base_of(parameters)
                        return parameters, is_base
                    window = MOST_UNDER_WAY if time.monotonic() - question.asked < FAST_S else 1
                    deadline, backoff = Deadline(timeout_s), Backoff(self._stop)
                    continue
            under_way.clear()  # whatever comes of them is of no use any more
            if reply is not None and not isinstance(reply, Busy):
                download.begin_again()  # the version is gone; or another learner answers
            if deadline.passed:
                raise _not_served(wanted, timeout_s)
            backoff.pause(deadline)

    def _is_base(self, part: ParametersShard | ParametersDelta) -> bool:
        """Tell whether a part is of a base."""
        return self._deltas and (part.renews if isinstance(part, ParametersDelta) else True)

    def _selector(self, download: Download, shard: int) -> str:
        """Ask for the first shard of what is to be read next, or for another one of what is being read."""
        selector = f"{self._keys.shard(shard)}?reader={self._reader}"
        if self._deltas:
            selector += f";base={NO_BASE if self._base is None else self._base.digest}"
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
        """Tell whether parameters that were fetched suffice, and no newer ones were heard of."""
        return self.newest is not None and fetched.head.stamp >= max(self.newest.stamp, at_least)

    def close(self) -> None:
        """Stop following."""
        self._subscriber.close()


def _not_served(wanted: tuple[int, int], timeout_s: float | None) -> ConnectionFailedError:
    return ConnectionFailedError(
        f"The learner did not serve parameters of version {wanted[1]} or later in {timeout_s:g} s."
    )
