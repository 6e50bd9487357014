"""The other side of `hoz-dist bench wire`: the wire of a learner that accepts everything and learns nothing."""

from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from typing import Any, Final

import numpy as np

from hoz_dist.bench.bare import TICK_S, BareReplies
from hoz_dist.bench.samples import gradient
from hoz_dist.config import RunConfig
from hoz_dist.gradient_forms import Vector
from hoz_dist.nav.categories import TARGETS
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.codec import encode
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.run_messages import ConfigReply, StatusReply
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.session import open_router
from hoz_dist.wire.transport.shared_memory import SharedMemory

KEYS: Final = Keys("bench")
EPOCH: Final = 1
PUBLISH_KEY: Final = "hoz-bench/publish"
"""Who asks here has the next version published before the answer comes, which is its number."""


def receive(
    endpoint: str,
    parameters: int,
    *,
    shared_memory: bool,
    ready: Callable[[], None],
    stopped: Callable[[float], bool],
) -> None:
    """Accept pushes and serve parameters until told to stop.

    Args:
        endpoint: Where to listen.
        parameters: P, the number of parameters.
        shared_memory: Whether large messages may pass through shared memory.
        ready: Called when it listens.
        stopped: Tells whether to stop; waits for that so many seconds.
    """
    config = RunConfig()
    accepted = Accepted(EPOCH, 0)
    versions, first = count(), published(parameters, 0)

    def publish() -> bytes:
        version = next(versions)
        publisher.publish(EPOCH, version, _later(first, version))
        return str(version).encode()

    with (
        SharedMemory(on=shared_memory) as memory,
        open_router(endpoint, shared_memory=memory.on) as session,
        ParametersPublisher(session, KEYS, memory=memory) as publisher,
        BareReplies(session, partial(encode, accepted)),
        BareReplies(session, publish, PUBLISH_KEY),
    ):
        snapshots = Snapshots(_config_reply(config.to_json()), _no_status, config.edge_cost)
        with Server(session, KEYS, snapshots, parameters=parameters) as server:
            ready()
            while not stopped(0.0):
                request = server.inbox.take(TICK_S)
                if request is not None:
                    request.answer(accepted)


def published(parameters: int, version: int) -> Vector:
    """Return the parameters [P] of a version."""
    return _later(gradient(parameters), version)


def _later(first: Vector, version: int) -> Vector:
    return first * np.float32(1.0 + version / 1000.0)


def _config_reply(config: Mapping[str, Any]) -> ConfigReply:
    return ConfigReply(KEYS.run, EPOCH, TARGETS, dict(config))


def _no_status() -> StatusReply:
    return StatusReply(0, EPOCH, (), (), {}, {})
