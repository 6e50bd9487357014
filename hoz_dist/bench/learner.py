"""`hoz-dist bench learner`: from a gradient's bytes to changed parameters, beside the optimiser alone."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import torch

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.bench.report import Metric
from hoz_dist.bench.samples import LATE, gradient
from hoz_dist.bench.timing import Contender, Progress, core_seconds, rate, run_contests, seconds_per_call
from hoz_dist.config import Compression, RunConfig
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.policy.settings import Preset
from hoz_dist.policy.threads import use_one_thread
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.codec import checksum, decode, encode
from hoz_dist.wire.protocol.pushes import GradientPush
from learner.core import LearnerCore
from learner.events import GradientReceived, Reply
from learner.optimizer import BETAS, EPSILON


class _Received(NamedTuple):
    """A push as it comes out of Zenoh."""

    payload: bytes
    attachment: bytes


def bench_learner(
    presets: Sequence[Preset],
    codecs: Sequence[Compression],
    *,
    seconds: float,
    repeats: int,
    progress: Progress,
) -> dict[str, Metric]:
    """Measure how long a gradient takes of a core: checksum, decoding, checks, and the update.

    Gradients are of the version before the last, lag 1, as they are where two actors take turns; one actor alone is
    never late, lag 0. The limit is fused Adam alone on as many parameters. The ratio of the two is taken of
    measurements that follow each other, and its limit is 1.

    Left out is what the learner does besides: copying the bytes out of Zenoh, the way from thread to thread, the
    answer, the record of the update, and publishing the parameters, which copies them. `hoz-dist bench train` has all
    of that.

    Args:
        presets: Sizes of the network.
        codecs: How the gradient travelled.
        seconds: Length of one measurement.
        repeats: Measurements of each figure.
        progress: Told how far the work is.
    """
    use_one_thread()
    cases = [(preset, codec) for preset in presets for codec in codecs]
    samples = run_contests([partial(_applying, *case, seconds) for case in cases], repeats, progress)
    metrics = {}
    for preset, codec in cases:
        name = f"learner_{preset}_{codec}"
        late, timely, alone = samples[name], samples[f"{name}, lag 0"], samples[f"{name}, Adam alone"]
        ratios = [mine / bare for mine, bare in zip(late, alone, strict=True)]
        metrics[f"{name}_ms"] = Metric.of(late, "ms", alone)
        metrics[f"{name}_ratio"] = Metric.of(ratios, "x Adam alone", 1.0)
        metrics[f"{name}_lag0_ms"] = Metric.of(timely, "ms", alone)
    return metrics


@contextmanager
def _applying(preset: Preset, codec: Compression, seconds: float) -> Iterator[Mapping[str, Contender]]:
    config = RunConfig(preset=preset, compress=codec)
    parameters = initial_parameters(config.policy, config.seed)
    core = LearnerCore(config, parameters)
    vector = gradient(parameters.size)
    compressed = Compressor(codec, vector.size, config.gradient_norm).compress(vector, LATE)
    push = GradientPush("a0", 1, 0, core.epoch, 0, config.batch, compressed)

    def receive(lag: int) -> _Received:
        payload = encode(replace(push, sequence=core.version, version=core.version - lag))
        return _Received(payload, checksum(payload))

    def apply(received: _Received) -> None:
        assert checksum(received.payload) == received.attachment  # noqa: S101 - measured: the server's first check
        message = decode(received.payload, GradientPush)
        effects = core.handle(GradientReceived(0, message), time.monotonic())
        assert any(isinstance(effect, Reply) and isinstance(effect.answer, Accepted) for effect in effects)  # noqa: S101

    def measure(lag: int) -> float:
        return 1000 * seconds_per_call(partial(receive, lag), apply, seconds, core_seconds)

    apply(receive(0))  # then there is a version before the last
    tensor = torch.from_numpy(parameters.copy())
    tensor.grad = torch.from_numpy(vector)
    adam = torch.optim.Adam([tensor], lr=config.learning_rate, betas=BETAS, eps=EPSILON, fused=True)
    name = f"learner_{preset}_{codec}"
    yield {
        name: partial(measure, 1),
        f"{name}, lag 0": partial(measure, 0),
        f"{name}, Adam alone": lambda: 1000 / rate(adam.step, seconds, core_seconds),
    }
