import threading
import time

import pytest

from hoz_dist.waiting import LONGEST_PAUSE_S, Backoff, Deadline, Patience, StoppedError


class Recorder(threading.Event):
    """An event that notes how long it was waited for, and does not wait."""

    def __init__(self) -> None:
        super().__init__()
        self.waits: list[float] = []

    def wait(self, timeout: float | None = None) -> bool:
        assert timeout is not None
        self.waits.append(timeout)
        return self.is_set()


def test_pauses_grow_to_a_bound_and_differ() -> None:
    stop = Recorder()
    backoff = Backoff(stop)
    for _ in range(40):
        backoff.pause(Deadline(None))
    assert stop.waits[0] < 0.06
    assert stop.waits[3] > stop.waits[0]
    assert max(stop.waits) <= LONGEST_PAUSE_S
    late = stop.waits[20:]
    assert min(late) >= LONGEST_PAUSE_S / 2
    assert len(set(late)) > 10, "without jitter, actors would come back all at once"


def test_a_pause_ends_with_the_deadline() -> None:
    stop = Recorder()
    Backoff(stop).pause(Deadline(0.0))
    assert stop.waits == [0.0]


def test_a_pause_ends_when_the_process_is_stopped() -> None:
    stop = threading.Event()
    stop.set()
    began = time.monotonic()
    with pytest.raises(StoppedError):
        Backoff(stop).pause(Deadline(None))
    assert time.monotonic() - began < 0.5


def test_a_deadline_limits_waits() -> None:
    assert Deadline(None).within(3.0) == 3.0
    assert not Deadline(None).passed
    assert Deadline(100.0).within(3.0) == 3.0
    assert 0.0 < Deadline(1.0).within(3.0) <= 1.0
    assert Deadline(-1.0).passed
    assert Deadline(-1.0).within(3.0) == 0.0


def test_tries_last_longer_after_each_that_timed_out_until_an_answer_comes() -> None:
    patience = Patience()
    waited = []
    for _ in range(6):
        waited.append(patience.seconds)
        patience.timed_out()
    assert waited == [10.0, 20.0, 40.0, 80.0, 160.0, 160.0]
    patience.answered(0.01)
    assert patience.seconds == 10.0
    patience.answered(15.0)
    assert patience.seconds == 30.0, "what the link takes is known now"
    patience.answered(500.0)
    assert patience.seconds == 160.0
