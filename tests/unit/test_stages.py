"""Where time goes, by stage; how long things really take is nobody's to say here."""

import threading
import time

import pytest

from hoz_dist.stages import StageClock

PAUSE_S = 0.02


def test_time_counts_for_the_innermost_stage() -> None:
    clock = StageClock()
    with clock("outer"), clock("inner"):
        time.sleep(PAUSE_S)
    totals = clock.totals()
    assert totals["inner"].wall_seconds >= PAUSE_S
    assert totals["outer"].wall_seconds < PAUSE_S
    assert (totals["outer"].passages, totals["inner"].passages) == (1, 1)


def test_waiting_takes_no_processor_time() -> None:
    clock = StageClock()
    with clock("wait"):
        time.sleep(PAUSE_S)
    with clock("work"):
        end = time.thread_time() + PAUSE_S
        while time.thread_time() < end:
            pass
    assert clock.totals()["wait"].cpu_seconds < PAUSE_S / 2
    assert clock.totals()["work"].cpu_seconds >= PAUSE_S


def test_stages_add_up_over_passages_and_threads() -> None:
    clock = StageClock()

    def pass_through() -> None:
        for _ in range(100):
            with clock("stage"):
                pass

    threads = [threading.Thread(target=pass_through) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert clock.totals()["stage"].passages == 400


def test_a_thread_is_in_its_own_stages_only() -> None:
    clock = StageClock()
    inside, leave = threading.Event(), threading.Event()

    def wait() -> None:
        with clock("other thread's"):
            inside.set()
            leave.wait()

    thread = threading.Thread(target=wait)
    with clock("mine"):
        thread.start()
        inside.wait()
        time.sleep(PAUSE_S)
        leave.set()
        thread.join()
    assert clock.totals()["mine"].wall_seconds >= PAUSE_S
    assert clock.totals()["other thread's"].wall_seconds >= PAUSE_S


def test_a_stage_that_fails_counts_and_ends() -> None:
    clock = StageClock()
    for _ in range(2):
        with pytest.raises(KeyError), clock("fails"):
            raise KeyError
    with clock("after"):
        pass
    assert clock.totals()["fails"].passages == 2
    assert set(clock.totals()) == {"fails", "after"}


def test_what_is_served_has_the_whole_process_and_each_stage() -> None:
    clock = StageClock()
    with clock("act"):
        pass
    values = clock.to_json()
    assert set(values) == {"wall_seconds", "cpu_seconds", "stages"}
    assert set(values["stages"]["act"]) == {"count", "wall_seconds", "cpu_seconds"}
    assert values["cpu_seconds"] > 0
