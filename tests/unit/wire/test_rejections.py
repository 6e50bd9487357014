import logging

import pytest

from hoz_dist.wire.protocol.rejection import Reason, shown
from hoz_dist.wire.protocol.rejections import MOST_SENDERS, OTHER_SENDERS, Rejections


def test_rejections_are_counted_by_reason_and_by_sender() -> None:
    rejections = Rejections()
    rejections.count(Reason.STALE, "old", "a0")
    rejections.count(Reason.STALE, "old", "a1")
    rejections.count(Reason.CHECKSUM, "damaged", "a1")
    assert rejections.by_reason() == {"stale": 2, "checksum": 1}
    assert rejections.by_sender() == {"a0": 1, "a1": 2}


def test_a_flood_is_logged_once_for_each_sender_and_reason(caplog: pytest.LogCaptureFixture) -> None:
    rejections = Rejections()
    with caplog.at_level(logging.WARNING):
        for _ in range(100):
            rejections.count(Reason.STALE, "old", "a0")
        rejections.count(Reason.SHAPE, "large", "a0")
    assert [record.getMessage() for record in caplog.records] == [
        "rejected a message of a0 (stale): old; 1 of this sender so far",
        "rejected a message of a0 (shape): large; 101 of this sender so far",
    ]


def test_invented_senders_do_not_fill_the_memory() -> None:
    rejections = Rejections()
    for number in range(MOST_SENDERS + 50):
        rejections.count(Reason.NAME, "?", f"s{number}")
    assert len(rejections.by_sender()) == MOST_SENDERS + 1
    assert rejections.by_sender()[OTHER_SENDERS] == 50


@pytest.mark.parametrize("value", ["x" * 10**6, b"x" * 10**6, [0] * 10**6, {"a": "x" * 10**6}, 10**1000], ids=type)
def test_what_is_quoted_is_short(value: object) -> None:
    assert len(shown(value)) < 50


@pytest.mark.parametrize("value", ["gradient", 2**64 - 1, 1.5, True, None])
def test_what_is_short_is_quoted_as_it_is(value: object) -> None:
    assert shown(value) == repr(value)
