"""Fetches parameters: follows the small heads that are published, and asks for the bulk shard by shard."""

import logging
import secrets
import threading

from zenoh import Session

from hoz_dist.closing import Closing
from hoz_dist.errors import ConnectionFailedError
from hoz_dist.waiting import Backoff, Deadline
from hoz_dist.wire.client.asking import Asking
from hoz_dist.wire.client.download import Download
from hoz_dist.wire.client.epochs import AnotherRunError, Epochs
from hoz_dist.wire.protocol.answers import Busy, Refused
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.parameters import Parameters, ParametersHead, ParametersShard
from hoz_dist.wire.protocol.rejection import RejectedError
from hoz_dist.wire.transport.publishing import NewestSubscriber

_log = logging.getLogger(__name__)


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
