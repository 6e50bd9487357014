"""The example of each kind of message in docs/wire-protocol.md: small, and the same in every language."""

import numpy as np

from hoz_dist.gradient_forms import Bf16Gradient, Gradient, Int8Gradient, TopKGradient
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.answers import Accepted, Busy, Refused
from hoz_dist.wire.protocol.graph_messages import PlanReply, RoomGraphReply, SceneGraphReply
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.parameters import ParametersDelta, ParametersHead, ParametersShard, digest_of
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.run_messages import ConfigReply, LeftProcess, ProcessStatus, StatusReply
from hoz_dist.wire.protocol.trajectories import Flag, GraphUsed, RoomUsed, Steps, TrajectoryPush

VECTOR = np.array([0.5, -0.25], np.float32)
HEAD = ParametersHead(2, 6, VECTOR.size)
BASE = np.array([0.5, 0.0], np.float32)
KITCHEN = RoomId("kitchen", 3)
CATEGORIES = ("Pan", "Sink")
NODES = np.array([[0.5, 1.0], [0.0, 0.25]])
EDGES = np.array([[1.0, 0.5], [0.5, 1.0]])


def rows(dtype: type[np.generic], *values: float) -> np.ndarray:
    """Steps of one episode, [T, 1]."""
    return np.array(values, dtype)[:, np.newaxis]


STEPS = Steps(
    room=rows(np.uint8, 0, 0, 0),
    view=rows(np.uint16, 32, 48, 48),
    target=rows(np.uint8, 18, 18, 18),
    flags=rows(np.uint8, Flag.FIRST | Flag.VALID | Flag.FRESH, Flag.VALID | Flag.TERMINATED, 0),
    scene=rows(np.uint8, 0, 0, 0),
    current=rows(np.uint8, 2, 2, 2),
    subgoal=rows(np.uint8, 1, 1, 1),
    previous_action=np.array([6], np.uint8),
    action=rows(np.uint8, 0, 5),
    reward=rows(np.float32, -0.01, 4.99),
    log_probability=rows(np.float32, -0.5, -0.25),
)


def gradient_push(gradient: Gradient) -> GradientPush:
    return GradientPush("a0", 7, 2, epoch=2, version=5, frames=40, gradient=gradient)


HALVES = np.array([0x3F80, 0xC000], np.uint16)
GRADIENTS: tuple[GradientPush, ...] = (
    gradient_push(Bf16Gradient(HALVES)),
    gradient_push(Int8Gradient(np.array([64, -127], np.int8), np.array([2 / 127], np.float32))),
    gradient_push(TopKGradient(300, np.array([7, 299], np.uint32), HALVES)),
)
"""A gradient of each codec but `fp32`, whose is among the examples of all kinds."""
EXAMPLES: tuple[Message, ...] = (
    gradient_push(np.array([1.0, -2.0], np.float32)),
    EpisodesPush(
        "a0",
        7,
        0,
        episodes=(EpisodeResult(KITCHEN, 5, success=True, actions=9, moves=4, said_done=True, optimal=7),),
        policy_loss=-0.5,
        value_loss=0.25,
        entropy=1.5,
    ),
    RoomGraphPush("a0", 7, 0, KITCHEN, "5f3a", CATEGORIES, NODES, EDGES),
    Accepted(2, 6),
    Busy(2),
    Refused("stale", "40 versions behind", 2),
    HEAD,
    ParametersShard(HEAD, 0, VECTOR),
    ParametersDelta(HEAD, digest_of(BASE), False, 0, np.array([0.25], np.float32), np.array([0, -1], np.int8)),
    ConfigReply("night-3", 2, CATEGORIES, {"method": "hoz", "seed": 3, "learning_rate": 0.001, "minutes": None}),
    StatusReply(
        6,
        2,
        (ProcessStatus("actor", "a0", "box-1", 7, ("kitchen/3",), 240, 120.5, 1.5, 1),),
        (LeftProcess("actor", "a1", "box-2", 9, 2.5),),
        {"stale": 1},
        {"frames": 240},
    ),
    SceneGraphReply(2, "kitchen", 1, (KITCHEN,), CATEGORIES, NODES, EDGES),
    RoomGraphReply(2, KITCHEN, "5f3a", CATEGORIES, NODES, EDGES),
    PlanReply(2, 0, 1, 1, (0, 1), 0.5),
    TrajectoryPush("a0", 7, 3, 2, 5, (RoomUsed(KITCHEN, "5f3a"),), (GraphUsed("kitchen", 2, 1),), STEPS),
)
