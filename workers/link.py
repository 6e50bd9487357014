"""An actor's side of the wire: joins a run, fetches parameters and graphs, pushes what the actor made."""

import dataclasses
import secrets
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.closing import Closing
from hoz_dist.config import RunConfig
from hoz_dist.errors import ConnectionFailedError, HozError, InvalidValueError, NotFoundError
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.stages import StageClock
from hoz_dist.waiting import Deadline, StoppedError
from hoz_dist.wire.client.discovery import find_run
from hoz_dist.wire.client.epochs import Epochs
from hoz_dist.wire.client.parameters import ParametersFollower
from hoz_dist.wire.client.push import Pusher
from hoz_dist.wire.membership.liveliness import Member, declare_alive, host_name
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.graph_messages import SceneGraphReply
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.message import MAX_EPISODES
from hoz_dist.wire.protocol.parameters import Parameters
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, Push, RoomGraphPush
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.trajectories import GraphUsed, RoomUsed, Steps, TrajectoryPush
from hoz_dist.wire.transport.publishing import NewestSubscriber
from hoz_dist.wire.transport.session import Session
from hoz_dist.wire.transport.shared_memory import SharedMemory
from workers.journal import Journal

JOIN_S: Final = 30.0
"""How long to look for the run: its learner may be starting again."""
GRAPH_S: Final = 10.0
"""How long a scene graph may take to arrive after the learner has accepted one of its rooms, seconds."""
STOP_S: Final = 0.5
"""How soon a wait for a scene graph notices that the process is to stop, seconds."""
GRAPH_TRIES: Final = 3
"""How often a room graph is pushed if no scene graph comes."""
FETCH_S: Final = 30.0
"""How long to wait for parameters before looking whether the run is still the same, seconds; longer than a slow link
takes for a shard."""


class LearnerLink(Closing):
    """What an actor says to its learner, and hears from it. Use it in a ``with`` statement.

    Every push blocks until the learner has acknowledged it, however long the learner is away.

    Args:
        session: Client session.
        actor: Name of the actor, unique among the live ones of the run.
        run: Name of the run; the only one that is found, when None.
        stop: Ends whatever waits, with `StoppedError`.
        journal: Where acknowledged pushes are noted.
        memory: Shared memory for large pushes.
        clock: Measures how long answers take.

    Attributes:
        config: Configuration of the run.
        run: Name of the run.
        epoch: Epoch of the learner at joining.

    Raises:
        HozError: No run is found, or several without a name; or the run is of other categories or another protocol
            version.
    """

    def __init__(
        self,
        session: Session,
        actor: str,
        run: str | None,
        stop: threading.Event,
        journal: Journal | None = None,
        memory: SharedMemory | None = None,
        clock: StageClock | None = None,
    ) -> None:
        reply = find_run(session, run, JOIN_S, stop)
        if reply.categories != TARGETS:
            message = f"Run '{reply.run}' has other categories: run the same release of hoz-dist on both sides."
            raise HozError(message)
        self.config = RunConfig.from_json(reply.config)
        self.run = reply.run
        self.epoch = reply.epoch
        self._session = session
        self._actor = actor
        self._stop = stop
        self._keys = Keys(reply.run)
        self._epochs = Epochs()
        self._epochs.hear(reply.epoch)
        self._incarnation = secrets.randbits(48)
        self._sequences: Counter[type[Push]] = Counter()
        self._compressor: Compressor | None = None
        """Made for the first gradient, which says how many entries they have."""
        self._new_pusher: Callable[[], Pusher] = lambda: Pusher(
            session,
            stop,
            epochs=self._epochs,
            acknowledged=journal.write if journal is not None else None,
            memory=memory,
            clock=clock,
        )
        self._pushers = threading.local()
        """Each thread that pushes has a pusher of its own, as its attribute ``own``."""
        with ExitStack() as stack:
            stack.enter_context(
                declare_alive(session, self._keys, Member("actor", actor, host_name(), self._incarnation))
            )
            self._parameters = stack.enter_context(
                ParametersFollower(session, self._keys, stop, self._epochs, deltas=self.config.parameters == "delta")
            )
            self._graphs = stack.enter_context(
                NewestSubscriber(
                    session,
                    self._keys.graph("*"),
                    SceneGraphReply,
                    key_of=lambda graph: self._keys.graph(graph.scene),
                    # A restarted learner may have forgotten the last rooms, and count from there.
                    replaces=lambda known, new: (new.epoch, new.version) > (known.epoch, known.version),
                    heard=lambda graph: self._epochs.hear(graph.epoch),
                )
            )
            self._open = stack.pop_all()

    def close(self) -> None:
        """Leave the run."""
        self._open.close()

    def parameters(self, at_least: tuple[int, int] | None = None) -> Parameters:
        """Fetch the newest parameters, however long the learner is away.

        Args:
            at_least: Epoch and version that they must have reached.

        Raises:
            HozError: The learner serves another run by now.
            StoppedError: The stop event was set.
        """
        while True:
            try:
                return self._parameters.fetch(at_least, FETCH_S)
            except ConnectionFailedError:
                self.check_same_run()

    def check_same_run(self) -> None:
        """Look whether the learner still serves the run that this actor joined; nobody there is no failure.

        Raises:
            HozError: It serves another configuration.
        """
        try:
            config = find_run(self._session, self.run, stop=self._stop)
        except (NotFoundError, InvalidValueError):
            return  # none, or two of them for the moment
        found = self._epochs.choose([config])
        if found is None:
            return  # a learner that was replaced, and does not know it yet
        if what := RunConfig.from_json(found.config).differences(self.config):
            message = f"The learner of '{self.run}' has begun another run ({'; '.join(what)}); start this actor again."
            raise HozError(message)

    def scene_graphs(self) -> Mapping[str, SceneGraphReply]:
        """Return the newest scene graphs that were heard of, by scene; one that did not change is the same object."""
        return {graph.scene: graph for graph in self._graphs.newest.values()}

    def push_gradient(
        self, gradient: NDArray[np.float32], frames: int, computed_on: tuple[int, int]
    ) -> Accepted | Refused:
        """Push a gradient in the form of the run's codec.

        Args:
            gradient: [P].
            frames: Environment frames that it was computed from.
            computed_on: Epoch and version of the parameters that it was computed on.
        """
        if self._compressor is None:
            self._compressor = Compressor(self.config.compress, gradient.size, self.config.gradient_norm)
        epoch, version = computed_on
        push = GradientPush(
            actor=self._actor,
            incarnation=self._incarnation,
            sequence=self._next(GradientPush),
            epoch=epoch,
            version=version,
            frames=frames,
            gradient=self._compressor.compress(gradient, version),
        )
        reply = self._push(self._keys.grads(self._actor), push)
        if isinstance(reply, Accepted):
            self._compressor.accepted()
        return reply

    def push_trajectory(
        self, steps: Steps, rooms: tuple[RoomUsed, ...], graphs: tuple[GraphUsed, ...], acted_on: tuple[int, int]
    ) -> Accepted | Refused:
        """Push a rollout; every one that was acted, one after the other.

        Args:
            steps: What was done and seen.
            rooms: The rooms that the steps count.
            graphs: The scene graphs that were used.
            acted_on: Epoch and version of the parameters that it was acted on.
        """
        epoch, version = acted_on
        push = TrajectoryPush(
            actor=self._actor,
            incarnation=self._incarnation,
            sequence=self._next(TrajectoryPush),
            epoch=epoch,
            version=version,
            rooms=rooms,
            graphs=graphs,
            steps=steps,
        )
        return self._push(self._keys.rollouts(self._actor), push)

    def push_episodes(self, episodes: Sequence[EpisodeResult], losses: Mapping[str, float]) -> Accepted | Refused:
        """Push how episodes ended and how the training goes; more than a message holds go in several.

        Args:
            episodes: Results, in the order in which the episodes ended.
            losses: Means since the last push of the terms of the loss, by the names of the fields of `EpisodesPush`;
                what is left out has that field's default.

        Returns:
            The answer to the last message, or the first refusal, after which nothing more is pushed.
        """
        for first in range(0, max(len(episodes), 1), MAX_EPISODES):
            push = EpisodesPush(
                actor=self._actor,
                incarnation=self._incarnation,
                sequence=self._next(EpisodesPush),
                episodes=tuple(episodes[first : first + MAX_EPISODES]),
                **losses,
            )
            reply = self._push(self._keys.rollouts(self._actor), push)
            if isinstance(reply, Refused):
                break
        return reply

    def push_room_graph(self, graph: RoomGraph) -> Accepted | Refused:
        """Push a room graph; after it is accepted, `scene_graphs` holds a scene graph that has the room.

        Raises:
            ConnectionFailedError: The learner accepts the room graph, but no scene graph comes.
            StoppedError: The stop event was set.
        """
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
        key = self._keys.graph(room.scene)
        for _ in range(GRAPH_TRIES):
            reply = self._push(self._keys.room(self._actor, room), push)
            if isinstance(reply, Refused) and reply.reason != Reason.INTERNAL:
                return reply
            if self._await_graph(lambda newest: key in newest and room in newest[key].rooms):
                return reply
            # A learner that was killed right after its answer has forgotten the room: tell it again.
            push = dataclasses.replace(push, sequence=self._next(RoomGraphPush))
        if isinstance(reply, Refused):
            return reply
        message = f"The learner accepted the graph of {room}, but its scene graph does not arrive; look at its log."
        raise ConnectionFailedError(message)

    def _await_graph(self, condition: Callable[[Mapping[str, SceneGraphReply]], bool]) -> bool:
        """Wait until the scene graphs are as wanted; False when they are not in time.

        Raises:
            StoppedError: The stop event was set.
        """
        deadline = Deadline(GRAPH_S)
        while not deadline.passed:
            if self._graphs.wait_for(condition, deadline.within(STOP_S)):
                return True
            if self._stop.is_set():
                raise StoppedError
        return False

    def _push(self, key: str, message: Push) -> Accepted | Refused:
        pusher: Pusher | None = getattr(self._pushers, "own", None)
        if pusher is None:
            self._pushers.own = pusher = self._new_pusher()
        return pusher.push(key, message)

    def _next(self, kind: type[Push]) -> int:
        self._sequences[kind] += 1
        return self._sequences[kind] - 1
