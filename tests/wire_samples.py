"""Valid messages and a small learner, for the tests of the wire and of the client."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.config import Compression
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.answers import Accepted, Busy, Refused
from hoz_dist.wire.protocol.graph_messages import PlanReply
from hoz_dist.wire.protocol.graphs import room_graph_reply, scene_graph_reply
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.parameters import ParametersDelta, ParametersHead, ParametersShard
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.run_messages import ConfigReply, LeftProcess, ProcessStatus, StatusReply
from hoz_dist.wire.serving.inbox import Inbox
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.session import Session, open_router

KEYS = Keys("run-1")
ROOM = RoomId("kitchen", 3)
EPISODE = EpisodeResult(ROOM, target=5, success=True, actions=9, moves=4, said_done=True, optimal=7)


def zone_graph(zones: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Nodes [K, N] and edges [K, K]."""
    rng = np.random.default_rng(7)
    edges = rng.uniform(0.01, 0.9, (zones, zones))
    edges = (edges + edges.T) / 2
    np.fill_diagonal(edges, 1.0)
    return rng.uniform(0, 1, (zones, len(TARGETS))), edges


def room_graph() -> RoomGraph:
    return RoomGraph(str(ROOM), "d1", *zone_graph())


def scene_graph(version: int = 2) -> SceneGraph:
    return SceneGraph("kitchen", version, ("kitchen/1", "kitchen/3"), TARGETS, *zone_graph())


def gradient_push(sequence: int = 0, actor: str = "a0", size: int = 100) -> GradientPush:
    gradient = np.random.default_rng(sequence).normal(size=size).astype(np.float32)
    return GradientPush(actor, incarnation=77, sequence=sequence, epoch=1, version=5, frames=40, gradient=gradient)


def gradient_push_in(codec: Compression, size: int = 300) -> GradientPush:
    """A gradient in the form of a codec; of 300 entries the blocks of `int8` are a whole one and a part of one."""
    full = gradient_push(size=size)
    assert isinstance(full.gradient, np.ndarray)
    return replace(full, gradient=Compressor(codec, size, 100.0).compress(full.gradient))


def config_reply(epoch: int = 1) -> ConfigReply:
    return ConfigReply(KEYS.run, epoch, TARGETS, {"method": "hoz", "seed": 3, "learning_rate": 1e-3, "minutes": None})


def status_reply() -> StatusReply:
    actor = ProcessStatus(
        "actor", "a0", "h1", 77, ("kitchen/3",), frames=800, frames_per_second=120.5, lag=1.5, rejected=1
    )
    details = {"frames": 800, "progress": 0.25, "success": {"overall": None, "scenes": {}}}
    processes = (actor, ProcessStatus("learner", "l0", "h2", 78))
    return StatusReply(5, 1, processes, (LeftProcess("actor", "a1", "h1", 79, 2.5),), {"epoch": 1}, details)


HEAD = ParametersHead(epoch=1, version=5, size=100)
MESSAGES: tuple[Message, ...] = (
    gradient_push(),
    EpisodesPush("a0", 77, 3, episodes=(EPISODE, EPISODE), policy_loss=-0.5, entropy=1.75),
    RoomGraphPush("a0", 77, 0, ROOM, "d1", TARGETS, *zone_graph()),
    Accepted(1, 5),
    Busy(1),
    Refused("stale", "too old", 1),
    HEAD,
    ParametersShard(HEAD, 0, np.arange(100, dtype=np.float32)),
    ParametersDelta(HEAD, "0123456789abcdef", True, 0, np.ones(1, np.float32), np.arange(100, dtype=np.int8)),
    config_reply(),
    scene_graph_reply(scene_graph(), 1),
    room_graph_reply(room_graph(), 1),
    PlanReply(1, 0, 3, 2, (0, 2, 3), 0.25),
    status_reply(),
    *(gradient_push_in(codec) for codec in ("bf16", "int8", "topk")),
)
"""One message of every kind, and a gradient in every form."""


@contextmanager
def serving(endpoint: str, epoch: int = 1, inbox: Inbox | None = None) -> Iterator[tuple[Server, Session]]:
    """A learner's session and server, with nobody who takes pushes out of its inbox."""
    snapshots = Snapshots(config_reply(epoch), status_reply, "product")
    with open_router(endpoint) as session, Server(session, KEYS, snapshots, inbox=inbox) as server:
        yield server, session
