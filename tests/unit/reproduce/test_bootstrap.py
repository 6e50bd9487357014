import numpy as np
import pytest
from scipy import stats

from hoz_dist.reproduce.bootstrap import REPLICATES, Resampling, degrees_of_freedom, stretch


def alone(episodes: int, replicates: int = REPLICATES) -> Resampling:
    """Draws of episodes of which each has a room to itself, so that drawing rooms is drawing episodes."""
    return Resampling(np.arange(episodes), np.zeros(episodes), replicates)


def normal_width(deviation: float) -> float:
    """Width of a 95% interval of a normal distribution."""
    return 2 * 1.96 * deviation


def student_width(of_seeds: np.ndarray, confidence: float = 0.95) -> float:
    """Width of an interval of the mean of a few seeds."""
    return float(2 * stats.t.ppf((1 + confidence) / 2, len(of_seeds) - 1) * stats.sem(of_seeds))


def test_with_one_seed_it_is_scipys_bootstrap_over_episodes() -> None:
    rng = np.random.default_rng(0)
    row, reference = rng.random(200) < 0.7, rng.random(200) < 0.5
    interval = alone(200).interval(row[None].astype(float), reference[None].astype(float), same_seeds=True)
    expected = stats.bootstrap(
        (row.astype(float) - reference.astype(float),), np.mean, n_resamples=4000, method="percentile", rng=1
    ).confidence_interval
    assert interval.difference == pytest.approx(row.mean() - reference.mean())
    assert interval.low == pytest.approx(expected.low, abs=0.01)
    assert interval.high == pytest.approx(expected.high, abs=0.01)


def test_equal_rows_differ_by_nothing() -> None:
    values = np.random.default_rng(0).random((3, 100))
    assert alone(100).interval(values, values, same_seeds=True) == (0.0, 0.0, 0.0)


def test_what_makes_episodes_hard_cancels_out() -> None:
    rng = np.random.default_rng(0)
    hardness = rng.random(400)
    row, reference = hardness + 0.1, hardness
    interval = alone(400).interval(row[None], reference[None], same_seeds=True)
    assert (interval.low, interval.high) == pytest.approx((0.1, 0.1), abs=1e-5)
    # Other seeds on either side: each row's own draw, but the same episodes.
    unpaired = alone(400).interval(np.tile(row, (2, 1)), np.tile(reference, (3, 1)), same_seeds=False)
    assert (unpaired.low, unpaired.high) == pytest.approx((0.1, 0.1), abs=1e-5)


def test_seeds_that_differ_widen_the_interval_as_they_should() -> None:
    # Episodes are all alike, so that seeds are all that is uncertain.
    of_seeds = np.array([0.2, 0.4, 0.5, 0.6, 0.8])
    row, reference = np.tile(of_seeds[:, None], (1, 50)), np.full((5, 50), 0.3)
    interval = alone(50).interval(row, reference, same_seeds=False)
    assert interval.high - interval.low == pytest.approx(student_width(of_seeds), rel=0.1)


@pytest.mark.parametrize("confidence", [0.5, 0.8, 0.9, 0.99])
def test_an_interval_is_as_wide_as_the_confidence_asks(confidence: float) -> None:
    # Of episodes alone, whose mean is normal.
    episodes = np.random.default_rng(0).standard_normal(400)
    of_episodes = alone(400).interval(episodes[None], np.zeros((1, 400)), same_seeds=True, confidence=confidence)
    normal = 2 * stats.norm.ppf((1 + confidence) / 2) * episodes.std() / 400**0.5
    assert of_episodes.high - of_episodes.low == pytest.approx(normal, rel=0.1)
    # Of seeds alone, which are few.
    of_seeds = np.random.default_rng(1).standard_normal(6)
    row, reference = np.tile(of_seeds[:, None], (1, 50)), np.zeros((6, 50))
    for same in (True, False):
        interval = alone(50).interval(row, reference, same_seeds=same, confidence=confidence)
        assert interval.high - interval.low == pytest.approx(student_width(of_seeds, confidence), rel=0.1)


@pytest.mark.parametrize(
    ("confidence", "student", "normal"), [(0.5, 0.741, 0.6745), (0.9, 2.132, 1.645), (0.95, 2.776, 1.960)]
)
def test_draws_of_seeds_are_stretched_as_the_confidence_asks(confidence: float, student: float, normal: float) -> None:
    # Quantiles of Student's t with four degrees of freedom, and of the normal distribution, out of a book's tables.
    assert stretch(5, 4, confidence) == pytest.approx((5 / 4) ** 0.5 * student / normal, rel=1e-3)
    assert stretch(1, 4, confidence) == 1.0  # one seed tells of no variance


def test_pairs_of_seeds_cancel_and_others_do_not() -> None:
    of_seeds = np.linspace(0.2, 0.8, 5)
    row, reference = np.tile(of_seeds[:, None] + 0.1, (1, 50)), np.tile(of_seeds[:, None], (1, 50))
    paired = alone(50).interval(row, reference, same_seeds=True)
    assert (paired.low, paired.high) == pytest.approx((0.1, 0.1), abs=1e-5)
    unpaired = alone(50).interval(row, reference, same_seeds=False)
    welch = stats.ttest_ind(row[:, 0], reference[:, 0], equal_var=False).confidence_interval()
    assert (unpaired.low, unpaired.high) == pytest.approx((welch.low, welch.high), abs=0.05)


@pytest.mark.parametrize(("of_row", "of_reference", "same"), [(3, 3, True), (5, 5, True), (3, 3, False), (3, 5, False)])
def test_a_few_seeds_are_not_taken_for_many(of_row: int, of_reference: int, same: bool) -> None:
    rng, draws, held = np.random.default_rng(5), alone(20, replicates=1000), 0
    for _ in range(400):
        row, reference = (np.repeat(rng.standard_normal((seeds, 1)), 20, axis=1) for seeds in (of_row, of_reference))
        interval = draws.interval(row, reference, same_seeds=same)
        held += interval.low <= 0.0 <= interval.high
    assert 0.9 <= held / 400 <= 0.99


@pytest.mark.parametrize("deviations", [(1.0, 1.0), (1.0, 0.1), (0.1, 1.0), (0.0, 1.0)])
def test_degrees_of_freedom_are_scipys(deviations: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    sides = [deviation * rng.standard_normal(seeds) for deviation, seeds in zip(deviations, (3, 5), strict=True)]
    assert degrees_of_freedom(sides) == pytest.approx(stats.ttest_ind(*sides, equal_var=False).df)
    assert degrees_of_freedom([sides[0] + 1e-9 * np.arange(3)]) == pytest.approx(2)
    assert degrees_of_freedom([sides[1], np.array([0.3])]) == pytest.approx(4)


def test_seeds_that_do_not_vary_have_no_noise() -> None:
    assert degrees_of_freedom([np.ones(3), np.ones(5)]) == np.inf


def test_intervals_of_chance_hold_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(3)
    draws, held = alone(150, replicates=400), 0
    for _ in range(200):
        hardness, suits = rng.random(150), 0.5 * rng.standard_normal(150)
        of_row, of_reference = 0.1 * rng.standard_normal((2, 8, 1))
        interval = draws.interval(hardness + suits + of_row, hardness + of_reference, same_seeds=False)
        held += interval.low <= 0.0 <= interval.high
    assert 0.88 <= held / 200 <= 0.99


@pytest.mark.parametrize("seeds", [1, 2, 3, 5])
def test_noise_of_single_cells_makes_intervals_too_wide_rather_than_too_narrow(seeds: int) -> None:
    rng, draws = np.random.default_rng(3), alone(150, replicates=400)
    rows = (rng.random((100, 2, seeds, 150)) < 0.5).astype(float)
    intervals = [draws.interval(*pair, same_seeds=True) for pair in rows]
    deviation = float(np.std([interval.difference for interval in intervals]))
    widths = [interval.high - interval.low for interval in intervals]
    widest = {1: 1.2, 2: 7.0, 3: 2.5, 5: 2.0}[seeds]
    assert 0.9 * normal_width(deviation) < np.mean(widths) < widest * normal_width(deviation)


@pytest.mark.parametrize(("scenes", "rooms"), [(4, 5), (1, 10)])
@pytest.mark.parametrize("seeds", [1, 5])
def test_rooms_that_suit_one_row_are_not_taken_for_all_rooms(scenes: int, rooms: int, seeds: int) -> None:
    room = np.arange(600) % (scenes * rooms)
    scene = room // rooms
    rng, draws, plain, held = np.random.default_rng(7), Resampling(room, scene, 400), alone(600, 400), [0, 0]
    for _ in range(200):
        suits = 0.05 * rng.standard_normal(scenes * rooms)[room]
        row = suits + 0.2 * rng.standard_normal(600) + 0.1 * rng.standard_normal((seeds, 600))
        for number, one in enumerate((draws, plain)):
            interval = one.interval(row, np.zeros((seeds, 600)), same_seeds=True)
            held[number] += interval.low <= 0.0 <= interval.high
    assert held[0] / 200 >= 0.89
    assert held[1] / 200 <= 0.85


def test_each_scene_has_as_many_rooms_in_every_draw() -> None:
    # Rooms of a scene are all alike, so that there is nothing uncertain, however much scenes differ.
    room = np.repeat(np.arange(8), 10)
    scene = np.repeat([0, 0, 0, 1, 1, 1, 1, 1], 10)  # of three rooms and of five
    row = np.where(scene == 0, 1.0, 0.2)[None]
    interval = Resampling(room, scene, 400).interval(row, np.zeros((1, 80)), same_seeds=True)
    assert interval == pytest.approx((0.5, 0.5, 0.5), abs=1e-5)


def test_the_same_data_give_the_same_interval() -> None:
    values = np.random.default_rng(0).random((2, 3, 60))
    first, again = (alone(60).interval(*values, same_seeds=True) for _ in range(2))
    assert first == again
