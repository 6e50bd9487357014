from learner.clock import LONGEST_GAP_S, TrainingClock


def test_time_counts_from_the_first_push() -> None:
    clock = TrainingClock(7.0)
    assert clock.seconds(1000.0) == 7.0
    clock.push(1000.0)
    clock.push(1010.0)
    assert clock.seconds(1015.0) == 22.0


def test_a_gap_counts_up_to_its_longest_and_time_never_runs_back() -> None:
    clock = TrainingClock()
    clock.push(0.0)
    assert clock.seconds(8 * 3600.0) == LONGEST_GAP_S
    clock.push(8 * 3600.0)
    assert clock.seconds(8 * 3600.0) == LONGEST_GAP_S
    assert clock.seconds(8 * 3600.0 + 5.0) == LONGEST_GAP_S + 5.0


def test_a_stopped_clock_stands() -> None:
    clock = TrainingClock()
    clock.push(0.0)
    clock.stop(3.0)
    assert clock.seconds(50.0) == 3.0
