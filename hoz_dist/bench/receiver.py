"""The other side of `hoz-dist bench wire`: the wire of a learner that accepts everything and learns nothing."""

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from hoz_dist.bench.bare import TICK_S, BareReplies
from hoz_dist.config import RunConfig
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


def receive(
    endpoint: str,
    parameters: int,
    *,
    shared_memory: bool,
    ready: Callable[[], None],
    stopped: Callable[[float], bool],
) -> None:
    """Accept pushes and serve parameters until told to stop; the first push changes the parameters.

    Args:
        endpoint: Where to listen.
        parameters: P, the number of parameters.
        shared_memory: Whether large messages may pass through shared memory.
        ready: Called when it listens.
        stopped: Tells whether to stop; waits for that so many seconds.
    """
    config = RunConfig()
    accepted = Accepted(EPOCH, 0)
    with (
        SharedMemory(on=shared_memory) as memory,
        open_router(endpoint, shared_memory=memory.on) as session,
        ParametersPublisher(session, KEYS, memory=memory) as publisher,
        BareReplies(session, encode(accepted)),
    ):
        vector = np.random.default_rng(0).standard_normal(parameters, dtype=np.float32)
        publisher.publish(EPOCH, 0, vector)
        version = 0
        snapshots = Snapshots(_config_reply(config.to_json()), _no_status, config.edge_cost)
        with Server(session, KEYS, snapshots, parameters=parameters) as server:
            ready()
            while not stopped(0.0):
                request = server.inbox.take(TICK_S)
                if request is not None:
                    request.answer(accepted)
                    if version == 0:
                        # Who has fetched the first version before it pushed gets later ones as a difference to it.
                        version = 1
                        publisher.publish(EPOCH, version, vector * np.float32(1.001))


def _config_reply(config: Mapping[str, Any]) -> ConfigReply:
    return ConfigReply(KEYS.run, EPOCH, TARGETS, dict(config))


def _no_status() -> StatusReply:
    return StatusReply(0, EPOCH, (), (), {}, {})
