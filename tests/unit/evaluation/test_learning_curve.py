import numpy as np
import pytest

from hoz_dist.evaluation.learning_curve import LearningCurve, frames_to, mean_curve

CURVE = LearningCurve((100, 200, 300, 400), (20.0, 60.0, 40.0, 80.0))


@pytest.mark.parametrize(
    ("success", "frames"), [(10.0, 50.0), (20.0, 100.0), (50.0, 175.0), (60.0, 200.0), (70.0, 375.0), (80.5, None)]
)
def test_frames_to_a_success_rate_lie_on_the_line_to_the_first_checkpoint_that_has_it(
    success: float, frames: float | None
) -> None:
    assert frames_to(CURVE, success) == (frames if frames is None else pytest.approx(frames))


def test_runs_are_averaged_where_all_of_them_go() -> None:
    other = LearningCurve((150, 350), (10.0, 30.0))
    both = mean_curve([CURVE, other])
    assert both is not None
    np.testing.assert_array_equal(both.frames, [150, 200, 300, 350])
    np.testing.assert_allclose(both.mean, [25.0, 37.5, 32.5, 45.0])
    np.testing.assert_allclose(both.low, [10.0, 15.0, 25.0, 30.0])
    np.testing.assert_allclose(both.high, [40.0, 60.0, 40.0, 60.0])


def test_one_run_is_its_own_mean() -> None:
    alone = mean_curve([CURVE])
    assert alone is not None
    np.testing.assert_array_equal(alone.frames, CURVE.frames)
    np.testing.assert_array_equal(alone.mean, CURVE.success)
    np.testing.assert_array_equal(alone.low, alone.high)


def test_runs_that_have_no_frames_in_common_have_no_mean() -> None:
    later = LearningCurve((500, 600), (10.0, 30.0))
    assert mean_curve([CURVE, later]) is None
    touching = mean_curve([CURVE, LearningCurve((400, 600), (10.0, 30.0))])
    assert touching is not None
    np.testing.assert_array_equal(touching.mean, [45.0])
