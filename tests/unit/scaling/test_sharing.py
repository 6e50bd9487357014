"""Sharing a host or a link, with times that one can tell by hand."""

import math

import pytest
import simpy

from hoz_dist.scaling.sharing import Shared


def ends(units: float, begins: list[tuple[float, float]], crowding: float = 0.0, switching: float = 0.0) -> list[float]:
    """Return when each user is done.

    Args:
        units: Of what is shared.
        begins: When each user comes, and how much work it has.
        crowding: See `Shared`.
        switching: The same.
    """
    env = simpy.Environment()
    shared = Shared(env, units, crowding=crowding, switching=switching)
    done = [0.0] * len(begins)

    def user(number: int, begin: float, work: float) -> simpy.events.ProcessGenerator:
        yield env.timeout(begin)
        yield shared.use(work)
        done[number] = env.now

    for number, (begin, work) in enumerate(begins):
        env.process(user(number, begin, work))
    env.run()
    if not switching:  # slower work uses units for longer
        assert shared.used() == pytest.approx(sum(work for _, work in begins))
    return done


def test_users_share_one_unit_evenly() -> None:
    assert ends(1, [(0, 1), (0, 2), (0, 3)]) == pytest.approx([3, 5, 6])


def test_who_comes_later_slows_down_who_is_there() -> None:
    assert ends(1, [(0, 2), (1, 2)]) == pytest.approx([3, 4])


def test_one_user_takes_one_unit_at_most() -> None:
    assert ends(2, [(0, 1), (0, 3)]) == pytest.approx([1, 3])
    assert ends(2, [(0, 2), (0, 2), (0, 2)]) == pytest.approx([3, 3, 3])


def test_units_need_not_be_whole() -> None:
    assert ends(0.5, [(0, 1)]) == pytest.approx([2])
    assert ends(1.5, [(0, 3), (0, 3)]) == pytest.approx([4, 4])


def test_infinitely_many_units_are_one_for_each() -> None:
    assert ends(math.inf, [(0, 1), (0, 2)], crowding=0.5, switching=0.5) == pytest.approx([1, 2])


def test_who_takes_turns_is_slowed_down_and_nobody_else() -> None:
    assert ends(2, [(0, 1), (0, 2)], switching=0.5) == pytest.approx([1, 2])
    # Three on two units: 3 s of turns instead of 2 without them, for 4 s of work; the last one then is alone.
    assert ends(2, [(0, 4 / 3), (0, 4 / 3), (0, 7 / 3)], switching=0.5) == pytest.approx([3, 3, 4])
    assert ends(2, [(0, 1)] * 4, crowding=0.2, switching=0.5) == pytest.approx([2 * 1.2 * 1.5] * 4)


def test_no_work_takes_no_time() -> None:
    assert ends(1, [(0, 0), (0, 1), (0.5, 0)]) == pytest.approx([0, 1, 0.5])


def test_many_equal_users_are_done_together() -> None:
    assert ends(3, [(0, 0.1)] * 30) == pytest.approx([1.0] * 30)
