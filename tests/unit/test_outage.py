import logging

import pytest

from hoz_dist.outage import Outage


def test_an_outage_is_said_once_and_its_end_once(caplog: pytest.LogCaptureFixture) -> None:
    outage = Outage(logging.getLogger("test"), "the disk is full: %s", "the disk has room")
    with caplog.at_level(logging.INFO):
        outage.worked()
        for _ in range(2):
            for attempt in range(5):
                outage.failed(attempt)
            outage.worked()
            outage.worked()
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        ("WARNING", "the disk is full: 0"),
        ("INFO", "the disk has room"),
    ] * 2
