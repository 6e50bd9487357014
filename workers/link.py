"""An actor's side of the wire: joins a run, fetches parameters and graphs, pushes what the actor made."""

import secrets
import threading
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from hoz_dist.config import RunConfig
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.discovery import find_run
from hoz_dist.wire.graphs import scene_graph_of
from hoz_dist.wire.keys import Keys
from hoz_dist.wire.liveliness import Member, declare_alive
from hoz_dist.wire.messages import (
    Accepted,
    EpisodesPush,
    GradientPush,
    Push,
    Refused,
    RoomGraphPush,
    SceneGraphReply,
)
from hoz_dist.wire.parameters import Parameters, ParametersFollower
from hoz_dist.wire.publishing import NewestSubscriber
from hoz_dist.wire.push import Pusher
from hoz_dist.wire.session import Session

GRAPH_S = 10.0
"""How long a scene graph may take to arrive after the learner has accepted one of its rooms, seconds."""
MAX_EPISODES = 4096
"""Finished episodes of one push; the wire's limit."""


class LearnerLink:
    """What an actor says to its learner, and hears from it. Use it in a ``with`` statement.

    Every push blocks until the learner has acknowledged it, however long the learner is away.

    Args:
        session: Client session.
        actor: Name of the actor, unique among the live ones of the run.
        run: Name of the run; the only one that is found, when None.
        stop: Ends whatever waits, with `StoppedError`.

    Raises:
        HozError: No run is found, or several without a name.
    """

    def __init__(self, session: Session, actor: str, run: str | None, stop: threading.Event) -> None:
        reply = find_run(session, run)
        self.config = RunConfig.from_json(reply.config)
        self.run = reply.run
        self._actor = actor
        self._keys = Keys(reply.run)
        self._incarnation = secrets.randbits(48)
        self._sequences: Counter[type[Push]] = Counter()
        self._pusher = Pusher(session, stop)
        self._open = ExitStack()
        self._open.enter_context(declare_alive(session, self._keys, Member("actor", actor)))
        self._parameters = self._open.enter_context(ParametersFollower(session, self._keys, stop))
        self._graphs = self._open.enter_context(
            NewestSubscriber(
                session,
                self._keys.graph("*"),
                SceneGraphReply,
                replaces=lambda known, new: (new.version, len(new.rooms)) != (known.version, len(known.rooms)),
            )
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def parameters(self, at_least: tuple[int, int] | None = None) -> Parameters:
        """Fetch the newest parameters.

        Args:
            at_least: Epoch and version that they must have reached.
        """
        return self._parameters.fetch(at_least)

    def scene_graphs(self) -> dict[str, SceneGraph]:
        """Return the newest scene graphs that were heard of, by scene."""
        return {graph.scene: scene_graph_of(graph) for graph in self._graphs.newest.values()}

    def push_gradient(
        self, gradient: NDArray[np.float32], frames: int, computed_on: tuple[int, int]
    ) -> Accepted | Refused:
        """Push a gradient.

        Args:
            gradient: [P].
            frames: Environment frames that it was computed from.
            computed_on: Epoch and version of the parameters that it was computed on.
        """
        epoch, version = computed_on
        push = GradientPush(
            actor=self._actor,
            incarnation=self._incarnation,
            sequence=self._next(GradientPush),
            epoch=epoch,
            version=version,
            frames=frames,
            gradient=gradient,
        )
        return self._pusher.push(self._keys.grads(self._actor), push)

    def push_episodes(
        self,
        episodes: Sequence[EpisodeResult],
        *,
        frames: int,
        frames_per_second: float,
        lag: float,
        losses: Mapping[str, float],
    ) -> Accepted | Refused:
        """Push how episodes ended and how the training goes.

        Args:
            episodes: Results, in the order in which the episodes ended.
            frames: Environment frames since the last push.
            frames_per_second: Speed since then.
            lag: Mean policy lag since then, versions.
            losses: Means of the terms of the loss since then: ``policy_loss, value_loss, entropy, scene_loss``.
        """
        push = EpisodesPush(
            actor=self._actor,
            incarnation=self._incarnation,
            sequence=self._next(EpisodesPush),
            frames=frames,
            frames_per_second=frames_per_second,
            lag=lag,
            episodes=tuple(episodes[:MAX_EPISODES]),
            **losses,
        )
        return self._pusher.push(self._keys.rollouts(self._actor), push)

    def push_room_graph(self, graph: RoomGraph) -> Accepted | Refused:
        """Push a room graph; after this, `scene_graphs` holds a scene graph that has the room."""
        room = RoomId.parse(graph.room)
        push = RoomGraphPush(
            actor=self._actor,
            incarnation=self._incarnation,
            sequence=self._next(RoomGraphPush),
            room=room,
            digest=graph.digest,
            categories=TARGETS,
            nodes=graph.nodes,
            edges=graph.edges,
        )
        reply = self._pusher.push(self._keys.room(room), push)
        if isinstance(reply, Accepted):
            key = self._keys.graph(room.scene)
            self._graphs.wait_for(lambda newest: key in newest and room in newest[key].rooms, GRAPH_S)
        return reply

    def _next(self, kind: type[Push]) -> int:
        self._sequences[kind] += 1
        return self._sequences[kind] - 1
