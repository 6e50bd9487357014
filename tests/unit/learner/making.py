"""Makes the messages, graphs and cores that the learner's tests work with."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hoz_dist.config import RunConfig
from hoz_dist.gradient_forms import Gradient
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from learner.core import LearnerCore
from learner.events import Effect, Event, GradientReceived, Reply
from learner.leadership import Leadership, claim, newest_epoch

SIZE = 11
ZONES = 3
CONFIG = RunConfig(zones=ZONES, learning_rate=0.01, max_lag=4, gradient_norm=10.0)

Float32 = NDArray[np.float32]


def vector(seed: int, size: int = SIZE) -> Float32:
    return np.random.default_rng(seed).normal(size=size).astype(np.float32)


def gradient(
    sequence: int,
    *,
    actor: str = "a",
    incarnation: int = 1,
    epoch: int = 1,
    version: int = 0,
    frames: int = 10,
    values: Gradient | None = None,
) -> GradientPush:
    values = vector(sequence) if values is None else values
    return GradientPush(
        actor=actor,
        incarnation=incarnation,
        sequence=sequence,
        epoch=epoch,
        version=version,
        frames=frames,
        gradient=values,
    )


def episodes(sequence: int, *outcomes: tuple[str, bool]) -> EpisodesPush:
    results = tuple(EpisodeResult(RoomId.parse(room), 0, success, 12, 6, True, 8) for room, success in outcomes)
    return EpisodesPush(actor="a", incarnation=1, sequence=sequence, episodes=results)


def room_graph(room: str, seed: int = 0, *, digest: str = "d0", zones: int = ZONES) -> RoomGraph:
    generator = np.random.default_rng(seed)
    edges = generator.uniform(size=(zones, zones))
    edges = (edges + edges.T) / 2
    np.fill_diagonal(edges, 1.0)
    return RoomGraph(room, digest, generator.uniform(size=(zones, len(TARGETS))), edges)


def room_push(sequence: int, graph: RoomGraph, categories: tuple[str, ...] = TARGETS) -> RoomGraphPush:
    return RoomGraphPush(
        actor="a",
        incarnation=1,
        sequence=sequence,
        room=RoomId.parse(graph.room),
        digest=graph.digest,
        categories=categories,
        nodes=graph.nodes,
        edges=graph.edges,
    )


def answer(core: LearnerCore, event: Event, now: float = 0.0) -> object:
    """The answer to a push; exactly one is given to each."""
    (reply,) = replies(core.handle(event, now))
    return reply.answer


def replies(effects: list[Effect]) -> list[Reply]:
    return [effect for effect in effects if isinstance(effect, Reply)]


def leading(run: Path) -> Leadership:
    """Lead a run folder in the epoch after the newest."""
    leadership = claim(run, newest_epoch(run))
    assert leadership is not None
    return leadership


def push(core: LearnerCore, *pushes: GradientPush, now: float = 0.0) -> list[object]:
    return [answer(core, GradientReceived(request, item), now) for request, item in enumerate(pushes)]
