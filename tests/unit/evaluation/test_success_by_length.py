import pytest
from scipy.stats import binomtest

from hoz_dist.evaluation.success_by_length import success_by_length, wilson_interval
from tests.unit.evaluation.making import analysed

WON, LOST, FAR = analysed("AAAAX"), analysed("AX"), analysed("RLLAAAAX", yaw=45)


def test_episodes_are_binned_by_their_optimal_path_and_count_once_in_all_trials() -> None:
    near, far = success_by_length([(WON, WON, FAR), (WON, LOST, FAR)])
    assert (near.label, near.episodes, near.sr) == ("1-4", 2, 75.0)
    assert near.low < 75.0 < near.high
    assert (far.label, far.episodes, far.sr, far.high) == ("5-9", 1, 100.0, 100.0)
    (one,) = success_by_length([(WON, FAR)], lengths=[1])
    assert (one.label, one.most, one.episodes) == ("1+", None, 2)


@pytest.mark.parametrize(("successes", "count"), [(0, 5), (1, 7), (30, 40), (12, 12)])
def test_the_interval_is_wilsons(successes: int, count: int) -> None:
    expected = binomtest(successes, count).proportion_ci(method="wilson")
    assert wilson_interval(successes, count) == pytest.approx((expected.low, expected.high), abs=1e-6)
