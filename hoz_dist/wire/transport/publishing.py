"""Publications of which only the newest matters: heads of parameters, graphs.

Zenoh's advanced publisher keeps its last sample for late joiners and announces it by heartbeat, so that a subscriber
that missed it, or comes back after the network was away, gets it all the same.
"""

import threading
from collections.abc import Callable, Mapping
from typing import Final, Generic, TypeVar

import zenoh
from zenoh import CongestionControl, Priority, Session
from zenoh.ext import (
    CacheConfig,
    HistoryConfig,
    MissDetectionConfig,
    RecoveryConfig,
    declare_advanced_publisher,
    declare_advanced_subscriber,
)
from zenoh.handlers import FifoChannel

from hoz_dist.closing import Closing
from hoz_dist.wire.protocol.codec import decode
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.rejections import Rejections
from hoz_dist.wire.transport.draining import Drain

M = TypeVar("M", bound=Message)
_HEARTBEAT_S: Final = 0.5


class NewestPublisher:
    """Publishes messages of which only the newest matters.

    Args:
        session: Session of the learner.
        key: Concrete key.
    """

    def __init__(self, session: Session, key: str) -> None:
        self._publisher = declare_advanced_publisher(
            session,
            key,
            # A subscriber that hangs must not hold up the learner; what is dropped is recovered by heartbeat. A
            # priority of its own keeps these small messages out of the queue of the bulk.
            congestion_control=CongestionControl.DROP,
            priority=Priority.INTERACTIVE_HIGH,
            cache=CacheConfig(max_samples=1),
            sample_miss_detection=MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S),
            publisher_detection=True,
        )

    def publish(self, payload: bytes) -> None:
        """Publish an encoded message."""
        self._publisher.put(payload)

    def close(self) -> None:
        """Stop publishing; late joiners find nothing from now on."""
        self._publisher.undeclare()  # type: ignore[no-untyped-call]


class NewestSubscriber(Closing, Generic[M]):
    """Keeps the newest message of each key.

    Args:
        session: Session to subscribe on.
        key_expr: Keys to follow.
        expected: Kind of the messages.
        key_of: The key that a message belongs on; on any other it is rejected.
        replaces: Whether the second message takes the place of the first one, which came before it.
        heard: Told of each message, whether it is kept or not.
    """

    def __init__(
        self,
        session: Session,
        key_expr: str,
        expected: type[M],
        key_of: Callable[[M], str],
        replaces: Callable[[M, M], bool],
        heard: Callable[[M], None] = lambda _: None,
    ) -> None:
        self._expected = expected
        self._heard = heard
        self._key_of = key_of
        self._replaces = replaces
        self._newest: Mapping[str, M] = {}
        self._arrived = threading.Condition()
        self._rejections = Rejections()
        subscriber = declare_advanced_subscriber(
            session,
            key_expr,
            FifoChannel(256),
            history=HistoryConfig(detect_late_publishers=True, max_samples=1),
            recovery=RecoveryConfig(periodic_queries=None, heartbeat=True),
        )
        self._drain = Drain(subscriber, self._keep, f"follows {key_expr}")

    @property
    def newest(self) -> Mapping[str, M]:
        """The newest message of each key that had one."""
        return self._newest

    def wait_for(self, condition: Callable[[Mapping[str, M]], bool], timeout_s: float) -> bool:
        """Wait until the newest messages are as wanted; False when they are not in time."""
        with self._arrived:
            return self._arrived.wait_for(lambda: condition(self._newest), timeout_s)

    def close(self) -> None:
        """Stop following."""
        self._drain.close()

    def _keep(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        try:
            message = decode(sample.payload.to_bytes(), self._expected)
            if key != self._key_of(message):
                detail = f"a {message.KIND} of {self._key_of(message)} came on {key}"
                raise RejectedError(Reason.IDENTITY, detail)  # noqa: TRY301 - rejected like any other
        except RejectedError as error:
            self._rejections.count(error.reason, error.detail, sender=key)
            return
        self._heard(message)
        known = self._newest.get(key)
        if known is None or self._replaces(known, message):
            with self._arrived:
                self._newest = {**self._newest, key: message}
                self._arrived.notify_all()
