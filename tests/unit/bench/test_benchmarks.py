"""Every benchmark that needs no other process, with tiny sizes: the figures that it promises are there."""

import math
from collections.abc import Mapping
from typing import get_args

import pytest

from hoz_dist.bench.learner import bench_learner
from hoz_dist.bench.policy import bench_policy
from hoz_dist.bench.report import Metric
from hoz_dist.cli.bench_options import CODECS, PRESETS
from hoz_dist.config import Compression
from hoz_dist.policy.settings import Preset
from learner.core import LearnerCore
from learner.events import Effect, Event, GradientReceived

MOMENT_S = 0.0001


def check(metrics: Mapping[str, Metric], names: set[str]) -> None:
    assert set(metrics) == names
    for metric in metrics.values():
        assert 0.0 < metric.min <= metric.median <= metric.max < math.inf
        assert metric.limit is None or metric.limit > 0.0


def silent(done: float, total: float, note: str) -> None:
    del note
    assert done <= total


def test_policy() -> None:
    metrics = bench_policy(("compact",), steps=2, seconds=MOMENT_S, repeats=1, progress=silent)
    acting = {f"policy_act_compact_b{batch}" for batch in (1, 64)}
    training = {f"policy_{kind}_compact_b{batch}" for kind in ("train", "train_recorded") for batch in (16, 64)}
    check(metrics, acting | training)
    assert {metric.unit for metric in metrics.values()} == {"frames/s"}


@pytest.mark.parametrize("codec", get_args(Compression))
def test_learner(codec: Compression) -> None:
    metrics = bench_learner(("compact",), (codec,), seconds=MOMENT_S, repeats=1, progress=silent)
    check(metrics, {f"learner_compact_{codec}_{figure}" for figure in ("ms", "ratio", "lag0_ms")})
    assert metrics[f"learner_compact_{codec}_ratio"].limit == 1.0


def test_gradients_for_the_learner_are_one_version_late_and_some_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    lags: list[int] = []

    class Noting(LearnerCore):
        def handle(self, event: Event, now: float) -> list[Effect]:
            assert isinstance(event, GradientReceived)
            lags.append(self.version - event.push.version)
            return super().handle(event, now)

    monkeypatch.setattr("hoz_dist.bench.learner.LearnerCore", Noting)
    bench_learner(("compact",), ("fp32",), seconds=0.0, repeats=2, progress=silent)
    # The first one makes a version; then they take turns, each round in the opposite order.
    assert lags == [0, 0, 1, 1, 0, 0, 1]


def test_the_options_offer_every_codec_and_size() -> None:
    assert get_args(Compression) == CODECS
    assert get_args(Preset) == PRESETS
