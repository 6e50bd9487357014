import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.container import BarContainer, ErrorbarContainer

from hoz_dist.evaluation.analysis import FAILURES, Analysis, causes
from hoz_dist.evaluation.analysis_table import CAUSE_NAMES
from hoz_dist.evaluation.episode_analysis import Cause
from hoz_dist.evaluation.learning_curve import LearningCurve
from hoz_dist.viz.analysis import failure_figure, learning_figure, length_figure
from hoz_dist.viz.zones import png
from tests.unit.evaluation.making import analysed

WON, FAR, BLIND, LONG = analysed("AAAAX"), analysed("AAX"), analysed("RR"), analysed("RLLAAAAX", yaw=45)
METHODS = [Analysis("one", ((WON, FAR, BLIND, LONG),)), Analysis("other", ((WON, WON, BLIND, LONG),))]


def test_bars_stack_the_failures_of_each_method() -> None:
    figure = failure_figure(METHODS, "test rooms")
    (axes,) = figure.axes
    assert axes.get_title() == "Why episodes fail, test rooms"
    assert [label.get_text() for label in axes.get_xticklabels()] == ["one", "other"]
    stacks = [container for container in axes.containers if isinstance(container, BarContainer)]
    assert [stack.get_label() for stack in stacks] == [CAUSE_NAMES[cause] for cause in FAILURES]
    assert len({to_rgba(stack.patches[0].get_facecolor()) for stack in stacks}) == len(FAILURES)
    for column, method in enumerate(METHODS):
        bars = [stack.patches[column] for stack in stacks]
        assert [bar.get_height() for bar in bars] == [causes(method)[cause] for cause in FAILURES]
        assert bars[-1].get_y() + bars[-1].get_height() == 100.0 - causes(method)[Cause.SUCCESS]
    assert png(figure)


def test_success_against_the_optimal_path_has_a_line_with_intervals_for_each_method() -> None:
    figure = length_figure(METHODS, "test rooms")
    (axes,) = figure.axes
    assert axes.get_title() == "Success against optimal path, test rooms"
    assert [label.get_text() for label in axes.get_xticklabels()] == ["1-4\n(3)", "5-9\n(1)"]
    lines = [container for container in axes.containers if isinstance(container, ErrorbarContainer)]
    assert [line.get_label() for line in lines] == ["one", "other"]
    for line, first in zip(lines, (100 / 3, 200 / 3), strict=True):
        heights = np.asarray(line.lines[0].get_ydata(), dtype=np.float64)
        np.testing.assert_allclose(heights, [first, 100.0])
    assert all(line.has_yerr for line in lines)
    assert png(figure)


def test_learning_curves_show_the_mean_and_the_range_of_a_methods_runs() -> None:
    runs = [LearningCurve((1_000_000, 2_000_000), (20.0, 60.0)), LearningCurve((1_000_000, 2_000_000), (40.0, 70.0))]
    figure = learning_figure({"hoz": runs, "a3c": runs[:1]})
    (axes,) = figure.axes
    assert [line.get_label() for line in axes.lines] == ["hoz (2 runs)", "a3c"]
    np.testing.assert_array_equal(axes.lines[0].get_xydata(), [[1.0, 30.0], [2.0, 65.0]])
    band = np.asarray(axes.collections[0].get_paths()[0].vertices)
    assert set(band[:, 1]) == {20.0, 40.0, 60.0, 70.0}
    assert png(figure)


def test_runs_without_frames_in_common_are_drawn_one_by_one() -> None:
    runs = [LearningCurve((1_000_000, 2_000_000), (20.0, 60.0)), LearningCurve((3_000_000,), (40.0,))]
    (axes,) = learning_figure({"hoz": runs}).axes
    assert [line.get_label() for line in axes.lines] == ["hoz (run 1)", "hoz (run 2)"]
    np.testing.assert_array_equal(axes.lines[0].get_xydata(), [[1.0, 20.0], [2.0, 60.0]])
    np.testing.assert_array_equal(axes.lines[1].get_xydata(), [[3.0, 40.0]])
    assert not axes.collections
