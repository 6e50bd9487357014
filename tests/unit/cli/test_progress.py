import io

import pytest
from rich.console import Console

from hoz_dist.cli.progress import Progress, duration, progress_text


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.2, "0 s"),
        (59.4, "59 s"),
        (59.6, "1 min 00 s"),
        (185, "3 min 05 s"),
        (3600, "1 h 00 min"),
        (7810, "2 h 10 min"),
    ],
)
def test_durations_read_well(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_text_says_count_speed_and_time_left() -> None:
    text = progress_text(1200, 2400, 5.0, "views", "kitchen/3")
    assert text == " 50%  1,200/2,400 views  240 views/s  kitchen/3  5 s left"


def test_text_takes_the_time_left_from_who_knows_it() -> None:
    # Work that goes on where it was: the time since this start tells nothing about the speed.
    assert progress_text(0.5, 1.0, 2.0, None, left=240.0) == " 50%  4 min 00 s left"


def test_text_of_a_time_budget_leaves_out_the_count() -> None:
    assert progress_text(60, 480, 60, None, "900 frames/s") == " 12%  900 frames/s  7 min 00 s left"


def test_text_at_the_end_says_how_long_it_took() -> None:
    assert progress_text(10, 10, 65, "views").endswith("took 1 min 05 s")


def test_text_before_anything_is_done_promises_nothing() -> None:
    assert progress_text(0, 10, 0.0, "views") == "  0%  0/10 views"
    assert "left" not in progress_text(0, 10, 3.0, "views")


def test_elsewhere_than_on_a_terminal_lines_come_seldom_and_the_last_state_always() -> None:
    out, clock = io.StringIO(), Clock()
    with Progress("Rendering", 100, "views", console=Console(file=out), every=5.0, clock=clock) as progress:
        for second in range(1, 13):
            clock.now = float(second)
            progress.update(second * 8, "[kitchen/3]")
    lines = out.getvalue().splitlines()
    assert [line.split()[1] for line in lines] == ["8%", "48%", "88%", "96%"]
    assert lines[0] == "Rendering    8%  8/100 views  8 views/s  [kitchen/3]  12 s left"


def test_the_total_may_become_known_better_on_the_way() -> None:
    out = io.StringIO()
    with Progress("Rendering", 10, "views", console=Console(file=out), every=0.0, clock=Clock()) as progress:
        progress.update(5)
        progress.update(5, total=20)
    assert [line.split()[1] for line in out.getvalue().splitlines()] == ["50%", "25%"]


def test_a_terminal_gets_a_bar() -> None:
    out, clock = io.StringIO(), Clock()
    console = Console(file=out, force_terminal=True, width=120)
    with Progress("Rendering", 100, "views", console=console, clock=clock) as progress:
        clock.now = 1.0
        progress.update(100)
    assert "━" in out.getvalue()
    assert "100/100 views" in out.getvalue()


@pytest.mark.parametrize("terminal", [False, True])
def test_what_is_said_on_the_way_stays(*, terminal: bool) -> None:
    out = io.StringIO()
    console = Console(file=out, force_terminal=terminal, width=120)
    with Progress("Reproducing", 10, None, console=console, every=60.0, clock=Clock()) as progress:
        progress.update(1)
        progress.say("hoz failed [again]")
        progress.update(2)
    assert "hoz failed [again]\n" in out.getvalue().replace("\r", "")
