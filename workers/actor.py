"""The actor: joins a run, gets its rooms ready, rolls out, and pushes gradients or the rollouts until the run is over.

Everything happens in one order, counted in updates, not in seconds: one actor with one seed does the same again. It
happens in one thread, except that a rollout waits for its answer in another one while the next is acted. The wire's own
threads only keep what arrived.
"""

import logging
import threading
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from hoz_dist.a3c.loss import mean_terms
from hoz_dist.errors import HozError
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.view_source import ViewSource
from hoz_dist.sim.view_store import ViewStore
from hoz_dist.stages import StageClock
from hoz_dist.waiting import StoppedError
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.graph_messages import SceneGraphReply
from hoz_dist.wire.protocol.graphs import scene_graph_of
from hoz_dist.wire.protocol.message import MAX_EPISODES
from hoz_dist.wire.protocol.parameters import Parameters
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.trajectories import GraphUsed
from workers.ahead import Ahead
from workers.collector import Collector, Trajectory
from workers.link import LearnerLink
from workers.preparation import RoomPreparation
from workers.timings import Timings

_log = logging.getLogger(__name__)
UPDATES_PER_ROOM: Final = 2
"""Updates between two rooms that are got ready: training begins with the first room, and soon has all."""
REPORT_ROLLOUTS: Final = 5
"""Rollouts between two reports of finished episodes, whatever became of their gradients."""
REPORT_EPISODES: Final = MAX_EPISODES // 2
"""Finished episodes that are reported at once."""
_PASSING: Final = frozenset({Reason.EPOCH, Reason.STALE, Reason.INTERNAL})
"""Reasons of refusals that the next push, of newer parameters, does not have."""


class RunOverError(Exception):
    """The learner takes nothing more, because the run's budget is used up; not a failure."""


@dataclass
class _Report:
    """What happened since the last report."""

    rollouts: int = 0
    losses: list[dict[str, float]] = field(default_factory=list)
    """Terms of the loss of each gradient that the learner accepted."""
    episodes: list[EpisodeResult] = field(default_factory=list)

    def add(self, finished: list[EpisodeResult]) -> None:
        """Note the episodes that ended in a rollout."""
        self.rollouts += 1
        self.episodes += finished

    @property
    def is_due(self) -> bool:
        """Whether it is time to send it."""
        return self.rollouts >= REPORT_ROLLOUTS or len(self.episodes) >= REPORT_EPISODES


class Actor:
    """One actor process's work.

    Args:
        link: To the learner.
        rooms: Rooms to train in.
        store: The view store.
        encoder: The visual encoder, the one of the run.
        source: Where observations come from: stored views, or PyBullet at every step.
        name: Name of the actor; with the run's seed and the learner's epoch it seeds the episodes and actions.
        stop: Ends the work at the next step.
        clock: Measures the stages of the work.
        timings: Where they are noted.
    """

    def __init__(
        self,
        link: LearnerLink,
        rooms: Sequence[RoomId],
        store: ViewStore,
        encoder: VisualEncoder,
        source: ViewSource,
        name: str,
        stop: threading.Event,
        clock: StageClock | None = None,
        timings: Timings | None = None,
    ) -> None:
        config = link.config
        # With the epoch, a run that is resumed goes on with other episodes than it began with.
        rng = np.random.default_rng([config.seed, zlib.crc32(name.encode()), link.epoch])
        self._link = link
        self._stop = stop
        self._clock = clock or StageClock()
        self._timings = timings
        self._preparation = RoomPreparation(
            rooms, store, encoder, zones=config.zones, clustering=config.clustering, actor=name
        )
        self._env = BatchEnv(config.batch, rng, source=source)
        self._collector = Collector(config, self._env, rng, self._clock)
        self._epoch = link.epoch
        self._newest: tuple[int, int] | None = None
        """Epoch and version that the next parameters must have reached."""
        self._room_graphs: list[RoomGraph] = []
        self._scene_graphs: dict[str, SceneGraphReply] = {}
        """The newest messages with graphs, by scene."""
        self._graphs_used: dict[str, GraphUsed] = {}
        """Those whose graphs are in use."""
        self._guided = config.policy.zone_layer
        self._report = _Report()
        self._frames = 0
        """Frames that the learner accepted."""
        self._ahead: Ahead[tuple[Accepted | Refused, int]] = Ahead("hoz pushes rollouts")
        self._parameters: Parameters | None = None
        """What the next rollout is acted on, if it is known already."""
        self._update = self._update_by_rollout if config.learn_from == "rollouts" else self._update_by_gradient

    def run(self) -> None:
        """Work until the run is over or `stop` is set.

        Raises:
            HozError: The learner refuses what this actor makes, now serves another run, or the view store fails.
        """
        updates = 0
        try:
            self._prepare_room()
            while not self._stop.is_set():
                if self._preparation.waiting and updates % UPDATES_PER_ROOM == UPDATES_PER_ROOM - 1:
                    self._prepare_room()
                self._refresh_graphs()
                self._update()
                updates += 1
                if self._timings is not None:
                    self._timings.update(self._frames, self._preparation.waiting)
            _log.info("stopped")
        except StoppedError:
            _log.info("stopped")
        except RunOverError:
            _log.info("the run is over")
        finally:
            self._ahead.close()

    def _prepare_room(self) -> None:
        with self._clock("rooms"):
            room = self._preparation.next(self._check_stop)
            self._push_room_graph(room.graph)
            self._room_graphs.append(room.graph)
            self._env.add_room(room.views)
        _log.info("%s is ready; %d rooms to go", room.views.room, self._preparation.waiting)

    def _check_stop(self, done: int, total: int) -> None:
        del done, total
        if self._stop.is_set():
            raise StoppedError

    def _push_room_graph(self, graph: RoomGraph) -> None:
        match self._link.push_room_graph(graph):
            case Refused(Reason.FINISHED):
                raise RunOverError
            case Refused(reason, detail):
                message = f"The learner refused the graph of {graph.room} ({reason}): {detail}."
                raise HozError(message)

    def _refresh_graphs(self) -> None:
        """Use the scene graphs that are new; no longer, once there are any, those that a learner before this served.

        Nobody may ever serve them again: a learner that was started again does not know the rooms that came last.
        """
        for scene, message in self._link.scene_graphs().items():
            if self._scene_graphs.get(scene) is message:
                continue
            self._scene_graphs[scene] = message
            try:
                self._collector.use_graph(scene_graph_of(message))
            except (HozError, ValueError) as error:
                _log.warning("the learner's graph of %s cannot be used: %s", scene, error)
            else:
                self._graphs_used[scene] = GraphUsed(scene, message.epoch, message.version)
        old = [scene for scene, used in self._graphs_used.items() if used.epoch < self._epoch]
        if len(old) < len(self._graphs_used):
            for scene in old:
                self._collector.drop_graph(scene)
                del self._graphs_used[scene]

    def _fetch(self) -> Parameters:
        """Return the newest parameters; tell a learner that was restarted what it may have forgotten."""
        with self._clock("parameters"):
            parameters = self._link.parameters(self._newest)
        if parameters.head.epoch != self._epoch:
            # A restarted learner knows what its last checkpoint held; a room graph that it has already is no change.
            self._epoch = parameters.head.epoch
            self._link.check_same_run()
            for graph in self._room_graphs:
                self._push_room_graph(graph)
        return parameters

    def _load(self, parameters: Parameters) -> None:
        with self._clock("load"):
            self._collector.load(parameters.vector, parameters.head.version)

    def _update_by_gradient(self) -> None:
        """Fetch parameters, roll out, push the gradient."""
        parameters = self._fetch()
        self._load(parameters)
        with self._clock("act"):
            update = self._collector.roll_out()
        self._report.add(update.finished)
        if not np.isfinite(update.gradient).all():
            _log.warning("a gradient is not finite; it is dropped")
        else:
            with self._clock("push"):
                reply = self._link.push_gradient(update.gradient, update.frames, parameters.head.stamp)
            if self._settle("gradient", reply, update.frames):
                self._report.losses.append(update.loss.terms())
        if self._report.is_due:
            self._send(self._take_report())

    def _update_by_rollout(self) -> None:
        """Act a rollout while the learner learns from the one before, and push it.

        Parameters are fetched after the answer to one push and before the next push. So an actor that is alone always
        acts on parameters that lack one rollout, the last, however long anything takes.
        """
        parameters = self._parameters or self._fetch()
        self._load(parameters)
        with self._clock("act"):
            trajectory = self._collector.record()
        self._report.add(trajectory.finished)
        used = trajectory.scenes if self._guided else ()
        graphs = tuple(self._graphs_used[scene] for scene in used if scene in self._graphs_used)
        self._settle_ahead()
        self._parameters = self._fetch()
        report = self._take_report() if self._report.is_due else None
        self._ahead.start(lambda: self._push_trajectory(trajectory, graphs, parameters.head.stamp, report))

    def _push_trajectory(
        self, trajectory: Trajectory, graphs: tuple[GraphUsed, ...], stamp: tuple[int, int], report: _Report | None
    ) -> tuple[Accepted | Refused, int]:
        """Push a rollout, and a report if there is one; return the answer to the rollout, and its frames."""
        with self._clock("push"):
            reply = self._link.push_trajectory(trajectory.steps, trajectory.rooms, graphs, stamp)
        if report is not None:
            self._send(report)
        return reply, trajectory.frames

    def _settle_ahead(self) -> None:
        """Wait for the answer to the rollout that is under way, if one is."""
        with self._clock("wait"):
            pushed = self._ahead.result()
        if pushed is not None:
            self._settle("rollout", *pushed)

    def _settle(self, what: str, reply: Accepted | Refused, frames: int) -> bool:
        """Take note of the answer to a push; return whether it counted.

        Raises:
            RunOverError: The budget is used up.
            HozError: It was refused for a reason that the next one would have as well.
        """
        match reply:
            case Accepted(epoch, version):
                self._frames += frames
                self._newest = (epoch, version)
                return True
            case Refused(Reason.FINISHED):
                raise RunOverError
            case Refused(reason, detail) if reason in _PASSING:
                _log.warning("a %s was refused (%s): %s", what, reason, detail)
                self._newest = None
            case Refused(reason, detail):
                message = f"The learner refused a {what} ({reason}): {detail}."
                raise HozError(message)
        return False

    def _take_report(self) -> _Report:
        report, self._report = self._report, _Report()
        return report

    def _send(self, report: _Report) -> None:
        with self._clock("report"):
            reply = self._link.push_episodes(report.episodes, mean_terms(report.losses))
        match reply:
            case Refused(reason, detail) if reason != Reason.FINISHED:
                _log.warning("a report of %d episodes was refused (%s): %s", len(report.episodes), reason, detail)
