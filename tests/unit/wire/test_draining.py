import logging
import queue
from collections.abc import Iterator

import pytest

from hoz_dist.wire.transport import draining
from hoz_dist.wire.transport.draining import Drain


class Channel:
    """A declared thing whose channel is a queue; None ends it."""

    def __init__(self) -> None:
        self.queue: queue.Queue[int | None] = queue.Queue()

    @property
    def handler(self) -> Iterator[int]:
        return iter(self.queue.get, None)

    def undeclare(self) -> None:
        self.queue.put(None)


def test_a_flood_of_failures_is_logged_now_and_then(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    clock = [100.0]
    monkeypatch.setattr("hoz_dist.wire.transport.draining.time.monotonic", lambda: clock[0])
    handled = []

    def fail(received: int) -> None:
        handled.append(received)
        clock[0] += 0.001 if received < 999 else draining.LOG_EVERY_S
        raise ValueError(received)

    channel = Channel()
    with caplog.at_level(logging.ERROR):
        drain = Drain(channel, fail, "tests")
        for number in range(1001):
            channel.queue.put(number)
        drain.close()
    assert len(handled) == 1001, "the thread lives on"
    assert [record.message for record in caplog.records] == [
        "hoz tests: failed to handle a message; 0 more since the last time",
        "hoz tests: failed to handle a message; 998 more since the last time",
        "hoz tests: failed to handle a message; 0 more since the last time",
    ]
    assert all(record.exc_info for record in caplog.records)
