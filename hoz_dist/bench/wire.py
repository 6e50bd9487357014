"""`hoz-dist bench wire`: pushes and parameters over the loopback address, beside a copy of as many bytes."""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import count
from typing import Final

import numpy as np

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.bench.bare import ask_bare
from hoz_dist.bench.receiver import EPOCH, KEYS, PUBLISH_KEY, published
from hoz_dist.bench.report import Metric
from hoz_dist.bench.samples import LATE, gradient
from hoz_dist.bench.timing import Contender, Progress, rate, run_contests, seconds_per_call
from hoz_dist.config import Compression, RunConfig
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.codec import encode
from hoz_dist.wire.protocol.parameters import Parameters
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush
from hoz_dist.wire.transport.session import Session, open_client
from hoz_dist.wire.transport.shared_memory import SharedMemory

ACTOR: Final = "bench"
DEADLINE_S: Final = 60.0
"""A push or fetch that takes longer has failed, seconds."""
_EPISODES: Final = 20
"""Episodes of a small push."""


def bench_wire(
    endpoint: str,
    shared_endpoint: str,
    parameters: int,
    codecs: Sequence[Compression],
    *,
    seconds: float,
    repeats: int,
    progress: Progress,
) -> dict[str, Metric]:
    """Measure pushes to receivers of other processes until they are acknowledged, and fetches of parameters.

    A push includes checks, encoding and checksum, a fetch decoding and digest. Each fetch is of another version, and a
    delta is computed for it, as for an actor that is alone. The limit is one copy of the bytes; of
    the small push, a question of Zenoh's with as many bytes there and back.

    Args:
        endpoint: Where a receiver listens.
        shared_endpoint: Where a receiver listens that has shared memory on.
        parameters: P, which both serve, and a gradient has.
        codecs: Codecs of which to tell the bytes of a gradient.
        seconds: Length of one measurement.
        repeats: Measurements of each figure.
        progress: Told how far the work is.
    """
    contests = [
        partial(_large, endpoint, shared_endpoint, parameters, seconds),
        partial(_small, endpoint, seconds),
    ]
    samples = run_contests(contests, repeats, progress)
    copy = samples["copy"]
    sizes = {codec: bytes_of_gradient(codec, parameters) for codec in codecs}
    return {
        "wire_push_ms": Metric.of(samples["push"], "ms", copy),
        "wire_push_shared_memory_ms": Metric.of(samples["push, shared memory"], "ms", copy),
        "wire_fetch_ms": Metric.of(samples["fetch"], "ms", copy),
        "wire_fetch_shared_memory_ms": Metric.of(samples["fetch, shared memory"], "ms", copy),
        "wire_fetch_delta_ms": Metric.of(samples["delta"], "ms", copy),
        "wire_fetch_delta_shared_memory_ms": Metric.of(samples["delta, shared memory"], "ms", copy),
        "wire_small_push_ms": Metric.of(samples["small push"], "ms", samples["bare question"]),
        **{f"wire_gradient_bytes_{codec}": Metric.of([size], "bytes") for codec, size in sizes.items()},
    }


def bytes_of_gradient(codec: Compression, size: int) -> int:
    """Return the length of a push of a gradient [P] that travels by a codec."""
    compressed = Compressor(codec, size, RunConfig.gradient_norm).compress(gradient(size), LATE)
    return len(encode(GradientPush(ACTOR, 1, 0, EPOCH, 0, 1, compressed)))


@contextmanager
def _large(endpoint: str, shared_endpoint: str, parameters: int, seconds: float) -> Iterator[Mapping[str, Contender]]:
    source = gradient(parameters).data.cast("B")
    with ExitStack() as stack:
        contenders: dict[str, Contender] = {"copy": partial(_milliseconds, lambda: bytearray(source), seconds)}
        for where, suffix in ((endpoint, ""), (shared_endpoint, ", shared memory")):
            memory = stack.enter_context(SharedMemory(on=bool(suffix)))
            session = stack.enter_context(open_client(where, shared_memory=memory.on))
            push = _pushing(session, memory, parameters)
            contenders["push" + suffix] = partial(_milliseconds, push, seconds)
            for kind, deltas in (("fetch", False), ("delta", True)):
                follower = stack.enter_context(ParametersFollower(session, KEYS, threading.Event(), deltas=deltas))
                contenders[kind + suffix] = partial(_fetching, session, follower, seconds)
                _check_kind(session, follower, deltas=deltas)
        yield contenders


@contextmanager
def _small(endpoint: str, seconds: float) -> Iterator[Mapping[str, Contender]]:
    episode = EpisodeResult(RoomId("kitchen", 1), 0, success=True, actions=20, moves=10, said_done=True, optimal=15)
    sequences = count()

    def message() -> EpisodesPush:
        return EpisodesPush(ACTOR, 1, next(sequences), (episode,) * _EPISODES)

    payload = encode(message())
    with open_client(endpoint) as session:
        pusher = Pusher(session, threading.Event())

        def push() -> None:
            _check(pusher.push(KEYS.rollouts(ACTOR), message(), DEADLINE_S))

        yield {
            "small push": partial(_milliseconds, push, seconds),
            "bare question": partial(_milliseconds, partial(ask_bare, session, payload), seconds),
        }


def _pushing(session: Session, memory: SharedMemory, parameters: int) -> Callable[[], None]:
    pusher, sequences = Pusher(session, threading.Event(), memory=memory), count()
    vector = gradient(parameters)

    def work() -> None:
        message = GradientPush(ACTOR, 1, next(sequences), EPOCH, 0, 1, vector)
        _check(pusher.push(KEYS.grads(ACTOR), message, DEADLINE_S))

    return work


def _publish(session: Session) -> int:
    return int(ask_bare(session, key=PUBLISH_KEY))


def _fetch(follower: ParametersFollower, version: int) -> Parameters:
    parameters = follower.fetch(timeout_s=DEADLINE_S)
    assert parameters.head.version == version  # noqa: S101 - none that was fetched before
    return parameters


def _fetching(session: Session, follower: ParametersFollower, seconds: float) -> float:
    return 1000 * seconds_per_call(partial(_publish, session), partial(_fetch, follower), seconds)


def _check_kind(session: Session, follower: ParametersFollower, *, deltas: bool) -> None:
    """See that versions come in full, or as deltas, which round them."""
    _fetch(follower, _publish(session))  # also the first delta is one to a version that came in full
    fetched = _fetch(follower, _publish(session))
    exact = published(fetched.head.size, fetched.head.version)
    assert np.allclose(fetched.vector, exact, atol=1e-4 * float(exact.max()))  # noqa: S101 - what is measured
    assert np.array_equal(fetched.vector, exact) is not deltas  # noqa: S101 - what is measured


def _check(answer: object) -> None:
    if not isinstance(answer, Accepted):
        raise TypeError(answer)


def _milliseconds(work: Callable[[], object], seconds: float) -> float:
    return 1000 / rate(work, seconds)
