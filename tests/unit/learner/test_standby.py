import errno
import logging
import os
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.errors import RunMismatchError
from learner.checkpoint import UnreadableError, save_checkpoint
from learner.core import LearnerCore
from learner.leadership import Leadership
from learner.run_folder import RunFolder
from learner.service import _Turns
from learner.standby import FREE_S, RECONNECTED_S, STILL_S, STOOD_STILL_S, ReadAhead, Sight, TakeOverRule, follow
from tests.unit.learner.disk import unreadable
from tests.unit.learner.making import CONFIG, gradient, push, vector

STEP_S = 0.05
CUT = Sight(connected=False, leader=False)
LED = Sight(connected=True, leader=True)
KILLED = Sight(connected=True, leader=False, epoch=1, held=False)
STILL = Sight(connected=True, leader=False, epoch=1, held=True)


class Standby:
    """Looks every 50 ms, and notes when it would have taken over."""

    def __init__(self) -> None:
        self.rule = TakeOverRule()
        self.now = 0.0

    def sees(self, sight: Sight, seconds: float) -> float | None:
        """See something for some time; return after how many seconds it took over."""
        start = self.now
        while self.now < start + seconds:
            if self.rule.is_time(sight, self.now):
                return self.now - start
            self.now += STEP_S
        return None


def test_it_never_takes_over_while_there_is_a_leader_or_no_network() -> None:
    standby = Standby()
    for sight in (LED, CUT, LED, CUT):
        assert standby.sees(sight, 60.0) is None


def test_a_killed_leader_is_followed_at_once() -> None:
    standby = Standby()
    standby.sees(LED, 10.0)
    assert standby.sees(KILLED, 10.0) == pytest.approx(FREE_S, abs=0.1)


def test_one_that_stands_still_is_given_time_to_come_back() -> None:
    standby = Standby()
    standby.sees(LED, 10.0)
    assert standby.sees(STILL, STILL_S - 0.2) is None
    standby.sees(LED, 1.0)
    assert standby.sees(STILL, 10.0) == pytest.approx(STILL_S, abs=0.1)


def test_after_the_routers_restart_the_others_have_time_to_come_back() -> None:
    standby = Standby()
    standby.sees(LED, 10.0)
    assert standby.sees(STILL, 0.1) is None  # the tokens go before the connection does
    standby.sees(CUT, 30.0)
    assert standby.sees(STILL, RECONNECTED_S - 0.2) is None
    standby.sees(LED, 1.0)
    standby.sees(CUT, 3.0)
    assert standby.sees(STILL, 10.0) == pytest.approx(RECONNECTED_S, abs=0.1)


def test_a_standby_that_starts_without_a_leader_leads_at_once() -> None:
    assert Standby().sees(Sight(connected=True, leader=False), 10.0) == pytest.approx(FREE_S, abs=0.1)


def test_who_claims_an_epoch_has_time_to_show_its_token() -> None:
    standby = Standby()
    standby.sees(LED, 1.0)
    standby.sees(STILL, STILL_S - 0.2)
    assert standby.sees(STILL._replace(epoch=2), STILL_S - 0.2) is None
    assert standby.sees(STILL._replace(epoch=2), 1.0) == pytest.approx(0.2, abs=0.1)


def test_a_standby_that_stood_still_itself_believes_nothing_that_it_saw_before() -> None:
    standby = Standby()
    standby.sees(LED, 1.0)
    standby.sees(STILL, STILL_S - 0.2)
    standby.now += STOOD_STILL_S + 0.1
    assert standby.sees(STILL, 10.0) == pytest.approx(RECONNECTED_S, abs=0.1)


def saved(folder: Path, updates: int, epoch: int = 1) -> Path:
    core = LearnerCore(CONFIG, vector(0), epoch=epoch)
    push(core, *(gradient(number, epoch=epoch, version=number) for number in range(updates)))
    return save_checkpoint(folder, core.snapshot(0.0))


def test_a_checkpoint_is_read_ahead_and_again_only_when_it_is_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[int] = []
    ahead = ReadAhead(tmp_path, lambda checkpoint: heard.append(checkpoint.version))
    ahead.refresh()  # there is none
    first = saved(tmp_path, 1)
    ahead.refresh()
    assert ahead.read(first) is ahead.read(first)
    assert ahead.read(first).version == 1
    before = ahead.read(first)
    assert saved(tmp_path, 1) == first  # the same version again, with another content
    ahead.refresh()
    assert ahead.read(first) is not before
    second = saved(tmp_path, 2)
    damaged = saved(tmp_path, 3)
    damaged.write_bytes(b"damaged")
    ahead.refresh()
    assert ahead.read(second).version == 2
    np.testing.assert_array_equal(ahead.read(first).parameters, before.parameters)
    assert heard == [1, 1, 2, 1], "whoever gets ready for the run hears of each"
    ahead.forget()
    ahead.refresh()
    assert heard[4:] == [], "the newest one is damaged"
    ahead.read(first)
    assert heard[4:] == [1]


def test_following_ends_with_the_leadership_of_the_next_epoch(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, CONFIG)
    with folder.claim_or_refuse() as first:
        folder.take_over(first)
    leadership = follow(folder, lambda: (True, False), ReadAhead(folder.checkpoints), threading.Event())
    assert leadership is not None
    with leadership:
        assert leadership.epoch == 2


def test_following_can_be_stopped(tmp_path: Path) -> None:
    folder, stop = RunFolder(tmp_path, CONFIG), threading.Event()
    looks = iter(range(5))

    def sight() -> tuple[bool, bool]:
        if next(looks) == 4:
            stop.set()
        return True, True

    assert follow(folder, sight, ReadAhead(folder.checkpoints), stop) is None


def test_a_run_that_another_configuration_has_begun_is_not_claimed(tmp_path: Path) -> None:
    with RunFolder(tmp_path, CONFIG).claim_or_refuse() as first:
        RunFolder(tmp_path, CONFIG).take_over(first)
    folder = RunFolder(tmp_path, replace(CONFIG, seed=9))
    with pytest.raises(RunMismatchError, match="seed"):
        follow(folder, lambda: (True, False), ReadAhead(folder.checkpoints), threading.Event())
    assert folder.newest_epoch() == 1


def test_a_run_that_cannot_be_read_now_is_claimed_once_it_can_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    monkeypatch.setattr("learner.standby.RETRY_S", 0.05)
    folder = RunFolder(tmp_path, CONFIG)
    with folder.claim_or_refuse() as first:
        folder.take_over(first)
        newest = saved(folder.checkpoints, 2)
    ahead, stop = ReadAhead(folder.checkpoints), threading.Event()
    for path in (newest, folder.checkpoints):
        caplog.clear()
        with unreadable(path):
            threading.Timer(1.5, stop.set).start()
            assert follow(folder, lambda: (True, False), ahead, stop) is None
        assert folder.newest_epoch() == 1
        assert [record.levelname for record in caplog.records] == ["WARNING"]
        assert "goes on trying" in caplog.text
        stop.clear()
    leadership = follow(folder, lambda: (True, False), ahead, stop)
    assert leadership is not None
    with leadership:
        run = folder.take_over(leadership, ahead.read)
    assert run.checkpoint is not None
    assert (leadership.epoch, run.checkpoint.version) == (2, 2)


@pytest.mark.parametrize("standby", [True, False])
def test_only_a_standby_follows_again_when_the_run_cannot_be_read_after_the_claim(
    tmp_path: Path, standby: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("learner.service.RETRY_S", 0.0)
    folder, stop = RunFolder(tmp_path, CONFIG), threading.Event()
    turns = object.__new__(_Turns)
    turns._folder = folder
    epochs: list[int] = []

    def lead(leadership: Leadership, *_: object) -> bool:
        with leadership:
            epochs.append(leadership.epoch)
            if len(epochs) == 1:
                raise UnreadableError(tmp_path, OSError(errno.EIO, os.strerror(errno.EIO)))
            return False

    monkeypatch.setattr(turns, "_follow", lambda ahead, _: folder.claim_or_refuse(ahead.read))
    monkeypatch.setattr(turns, "_lead", lead)
    ahead = ReadAhead(folder.checkpoints)
    if standby:
        turns.take(None, ahead, stop)
        assert epochs == [1, 2]
        return
    with pytest.raises(UnreadableError, match="Cannot read"):
        turns.take(folder.claim_or_refuse(), ahead, stop)
    assert epochs == [1]
