"""Valid messages and a small learner, for the tests of the wire and of the client."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import get_args

import numpy as np

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.config import Compression
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.actions import NO_ACTION, Action
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
from hoz_dist.wire.protocol.trajectories import Flag, GraphUsed, RoomUsed, Steps, TrajectoryPush
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
    return replace(full, gradient=Compressor(codec, size, 100.0).compress(full.gradient, version=1000))


def config_reply(epoch: int = 1) -> ConfigReply:
    return ConfigReply(KEYS.run, epoch, TARGETS, {"method": "hoz", "seed": 3, "learning_rate": 1e-3, "minutes": None})


def status_reply() -> StatusReply:
    actor = ProcessStatus(
        "actor", "a0", "h1", 77, ("kitchen/3",), frames=800, frames_per_second=120.5, lag=1.5, rejected=1
    )
    details = {"frames": 800, "progress": 0.25, "success": {"overall": None, "scenes": {}}}
    processes = (actor, ProcessStatus("learner", "l0", "h2", 78))
    return StatusReply(5, 1, processes, (LeftProcess("actor", "a1", "h1", 79, 2.5),), {"epoch": 1}, details)


def steps_of(shape: tuple[int, int] = (5, 3), rooms: int = 1, seed: int = 0) -> Steps:
    """T steps of B episodes, which begin and end as episodes do."""
    rng, rows = np.random.default_rng(seed), (shape[0] + 1, shape[1])
    action = rng.integers(0, 6, shape).astype(np.uint8)
    flags = np.zeros(rows, np.uint8)
    flags[0] = Flag.FIRST | Flag.FRESH
    for t in range(shape[0]):
        resets = (t > 0) & ((flags[t - 1] & (Flag.TERMINATED | Flag.TRUNCATED)) > 0)
        done = (action[t] == Action.DONE) & ~resets
        flags[t] |= ~resets * np.uint8(Flag.VALID) | done * np.uint8(Flag.TERMINATED)
        flags[t + 1] |= resets * np.uint8(Flag.FIRST | Flag.FRESH)
    slots = np.arange(shape[1]) % rooms
    return Steps(
        room=np.broadcast_to(slots, rows).astype(np.uint8),
        view=rng.integers(0, 2000, rows).astype(np.uint16),
        target=np.full(rows, 18, np.uint8),
        flags=flags,
        scene=np.zeros(rows, np.uint8),
        current=rng.integers(0, 8, rows).astype(np.uint8),
        subgoal=rng.integers(0, 8, rows).astype(np.uint8),
        previous_action=np.full(shape[1], NO_ACTION, np.uint8),
        action=action,
        reward=np.full(shape, -0.01, np.float32),
        log_probability=-rng.random(shape, dtype=np.float32),
    )


def trajectory_push(steps: Steps | None = None, rooms: int = 1) -> TrajectoryPush:
    used = tuple(RoomUsed(RoomId("kitchen", number + 1), "0123456789abcdef" * 2) for number in range(rooms))
    return TrajectoryPush("a0", 77, 2, 1, 5, used, (GraphUsed("kitchen", 1, 2),), steps or steps_of(rooms=rooms))


HEAD = ParametersHead(epoch=1, version=5, size=100)
MESSAGES: tuple[Message, ...] = (
    gradient_push(),
    EpisodesPush("a0", 77, 3, episodes=(EPISODE, EPISODE), policy_loss=-0.5, entropy=1.75, approach_loss=0.5),
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
    trajectory_push(),
)
"""One message of every kind."""
GRADIENTS: Mapping[Compression, GradientPush] = {codec: gradient_push_in(codec) for codec in get_args(Compression)}
"""A gradient in every form."""


@contextmanager
def serving(endpoint: str, epoch: int = 1, inbox: Inbox | None = None) -> Iterator[tuple[Server, Session]]:
    """A learner's session and server, with nobody who takes pushes out of its inbox."""
    snapshots = Snapshots(config_reply(epoch), status_reply, "product")
    with open_router(endpoint) as session, Server(session, KEYS, snapshots, inbox=inbox) as server:
        yield server, session
