"""What the benchmark of training makes of what actors and a learner write."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.bench.timings import TimingsFile, between, totals_of
from hoz_dist.bench.training import Measured, Trainers, Window, bottleneck, metrics_of, prediction_metrics, turns_metric
from hoz_dist.errors import HozError

LEARNER = {"receive": 0.2, "apply": 0.3, "idle": 5.0}


def line(time: float, updates: int, waiting: int = 0, **stages: float) -> str:
    totals = {name: {"count": updates, "wall_seconds": s, "cpu_seconds": s / 2} for name, s in stages.items()}
    about = {"time": time, "updates": updates, "frames": 100 * updates, "rooms_waiting": waiting}
    return json.dumps(about | {"wall_seconds": time, "cpu_seconds": time / 2, "stages": totals}) + "\n"


class Still(Trainers):
    """Processes that did all beforehand."""

    files: Sequence[TimingsFile] = ()

    def resume(self) -> None:
        pass

    def pause(self) -> None:
        pass

    def check(self) -> None:
        pass


def measured(**walls: float) -> Measured:
    """A run of two windows of 10 s and 5 updates, in which the stages took as long as is said."""
    actors: Any = {"updates": 5.0, "frames": 500.0, "wall": 10.0, "cpu": 4.0}
    actors |= {f"{stage}.wall": seconds for stage, seconds in walls.items()}
    learner = {f"{stage}.wall": seconds for stage, seconds in LEARNER.items()} | {"cpu": 1.0}
    return Measured(Still(), [Window(10.0, actors, learner)] * 2)


def test_a_file_is_read_as_it_grows_and_only_whole_lines(tmp_path: Path) -> None:
    path = tmp_path / "timings"
    file = TimingsFile(path)
    assert not file.is_ready
    path.write_text(line(10.0, 1, waiting=1) + line(12.0, 2, waiting=0)[:20])
    assert file.updates_since(0.0) == 1
    assert not file.is_ready
    path.write_text(line(10.0, 1, waiting=1) + line(12.0, 2, waiting=0))
    assert file.updates_since(0.0) == 2
    assert file.updates_since(10.0) == 1
    assert file.is_ready


def test_between_two_updates_totals_grow_evenly(tmp_path: Path) -> None:
    (tmp_path / "timings").write_text(line(10.0, 1, act=1.0) + line(20.0, 3, act=2.0, push=1.0))
    file = TimingsFile(tmp_path / "timings")
    assert file.is_ready
    amount = between(file.at(12.5), file.at(17.5))
    assert (amount["updates"], amount["frames"]) == (1.0, 100.0)
    assert [amount["act.wall"], amount["push.wall"]] == pytest.approx([0.5, 0.5])
    with pytest.raises(HozError, match="with --seconds"):
        file.at(20.5)


def test_totals_have_a_name_for_each_stage() -> None:
    totals = totals_of(json.loads(line(4.0, 2, act=1.0)))
    assert totals == {
        "updates": 2.0,
        "frames": 200.0,
        "wall": 4.0,
        "cpu": 2.0,
        "act.count": 2.0,
        "act.wall": 1.0,
        "act.cpu": 0.5,
    }


def test_figures_are_of_an_update_and_the_rest_is_other() -> None:
    found = metrics_of(measured(act=5.0, differentiate=4.0), measured(act=2.5))
    assert (found["frames_per_second"].median, found["frames_per_second"].limit) == (50.0, 50.0)
    assert found["share_of_in_process"].median == 1.0
    assert (found["actor_act_ms"].median, found["actor_act_ms"].limit) == (1000.0, 500.0)
    assert found["actor_other_ms"].median == 200.0
    assert found["learner_apply_ms"].median == 60.0
    assert (found["actor_cpu_ms"].median, found["learner_cpu_ms"].median) == (800.0, 200.0)
    assert all(name.endswith("_a4") for name in metrics_of(measured(act=1.0), None, "_a4"))


def test_a_prediction_is_compared_with_what_was_measured() -> None:
    found = prediction_metrics(measured(act=5.0), 60.0, "_a4")
    predicted, ratio = found["predicted_frames_per_second_a4"], found["prediction_ratio_a4"]
    assert (predicted.median, predicted.limit) == (60.0, None)
    assert (ratio.median, ratio.limit) == (1.2, 1.0)


def test_turns_are_told_by_processor_time_of_a_frame_window_by_window() -> None:
    def process(*windows: tuple[float, float]) -> Measured:
        return Measured(Still(), [Window(4.0, {"cpu": cpu, "frames": frames}, {}) for cpu, frames in windows])

    # Something else takes half of the core from the first in one window, and slows down both in another.
    one, two = process((4.0, 400.0), (2.0, 200.0), (4.0, 200.0)), process((4.0, 320.0), (4.0, 320.0), (4.0, 160.0))
    found = turns_metric(one, two)
    assert (found.min, found.max) == pytest.approx((1.25, 1.25))
    assert (found.unit, found.limit) == ("x alone", 1.0)


def test_what_goes_on_while_the_actor_acts_is_none_of_its_time() -> None:
    run = measured(act=6.0, wait=3.0, answer=8.0)
    for window in run.windows:
        window.actors["wait.count"] = 5.0
    assert metrics_of(run, None)["actor_other_ms"].median == pytest.approx(200.0)
    assert bottleneck(run) == "actor act"


def test_actors_that_do_not_get_on_are_not_waited_for_for_ever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hoz_dist.bench.training.LONGEST_S", 0.0)
    stuck = Still()
    stuck.files = (TimingsFile(tmp_path / "timings"),)
    with pytest.raises(HozError, match="made no update for 0 s"):
        stuck.await_updates(1, 0.0)
    with pytest.raises(HozError, match="made no update for 0 s"):
        list(stuck.await_rooms())


def test_the_bottleneck_is_the_longest_stage_and_the_learners_when_actors_wait() -> None:
    assert bottleneck(measured(act=5.0, differentiate=4.0)) == "actor act"
    assert bottleneck(measured(act=1.0, answer=8.0)) == "learner apply"
