"""The actor: joins a run, gets its rooms ready, rolls out, and pushes gradients until the run is over.

Everything happens in one thread and in one order, counted in updates, not in seconds: one actor with one seed does the
same again. The wire's own threads only keep what arrived.
"""

import logging
import threading
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

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
from hoz_dist.wire.protocol.rejection import Reason
from workers.collector import Collector
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
"""Reasons of refusals that the next gradient, computed on newer parameters, does not have."""


class RunOverError(Exception):
    """The learner takes nothing more, because the run's budget is used up; not a failure."""


@dataclass
class _Report:
    """What happened since the last report."""

    rollouts: int = 0
    updates: int = 0
    """Gradients that the learner accepted."""
    losses: Counter[str] = field(default_factory=Counter)
    """Sums of the terms of the loss over them."""
    episodes: list[EpisodeResult] = field(default_factory=list)

    @property
    def is_due(self) -> bool:
        """Whether it is time to send it."""
        return self.rollouts >= REPORT_ROLLOUTS or len(self.episodes) >= REPORT_EPISODES

    @property
    def mean_losses(self) -> dict[str, float]:
        """Means of the terms of the loss; empty, which the wire takes for 0, if no gradient was accepted."""
        return {name: total / self.updates for name, total in self.losses.items()}


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
        self._preparation = RoomPreparation(rooms, store, encoder, zones=config.zones, actor=name)
        self._env = BatchEnv(config.batch, rng, source=source)
        self._collector = Collector(config, self._env, rng, self._clock)
        self._epoch = link.epoch
        self._newest: tuple[int, int] | None = None
        """Epoch and version that the next parameters must have reached."""
        self._room_graphs: list[RoomGraph] = []
        self._scene_graphs: dict[str, SceneGraphReply] = {}
        """The messages whose graphs are in use, by scene."""
        self._report = _Report()
        self._frames = 0
        """Frames that the learner accepted."""

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
                if self._report.is_due:
                    self._send_report()
            _log.info("stopped")
        except StoppedError:
            _log.info("stopped")
        except RunOverError:
            _log.info("the run is over")

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
        """Use the scene graphs that are new."""
        for scene, message in self._link.scene_graphs().items():
            if self._scene_graphs.get(scene) is message:
                continue
            self._scene_graphs[scene] = message
            try:
                self._collector.use_graph(scene_graph_of(message))
            except (HozError, ValueError) as error:
                _log.warning("the learner's graph of %s cannot be used: %s", scene, error)

    def _update(self) -> None:
        """Fetch parameters, roll out, push the gradient."""
        with self._clock("parameters"):
            parameters = self._link.parameters(self._newest)
        if parameters.head.epoch != self._epoch:
            # A restarted learner knows what its last checkpoint held; a room graph that it has already is no change.
            self._epoch = parameters.head.epoch
            self._link.check_same_run()
            for graph in self._room_graphs:
                self._push_room_graph(graph)
        with self._clock("load"):
            self._collector.parameters.load(parameters.vector)
        with self._clock("act"):
            update = self._collector.roll_out()
        self._report.rollouts += 1
        self._report.episodes += update.finished
        if not np.isfinite(update.gradient).all():
            _log.warning("a gradient is not finite; it is dropped")
            return
        with self._clock("push"):
            reply = self._link.push_gradient(update.gradient, update.frames, parameters.head.stamp)
        match reply:
            case Accepted(epoch, version):
                self._frames += update.frames
                self._newest = (epoch, version)
                self._report.updates += 1
                self._report.losses.update(update.loss.terms())
            case Refused(Reason.FINISHED):
                raise RunOverError
            case Refused(reason, detail) if reason in _PASSING:
                _log.warning("a gradient was refused (%s): %s", reason, detail)
                self._newest = None
            case Refused(reason, detail):
                message = f"The learner refused a gradient ({reason}): {detail}."
                raise HozError(message)

    def _send_report(self) -> None:
        report, self._report = self._report, _Report()
        with self._clock("report"):
            reply = self._link.push_episodes(report.episodes, report.mean_losses)
        match reply:
            case Refused(reason, detail) if reason != Reason.FINISHED:
                _log.warning("a report of %d episodes was refused (%s): %s", len(report.episodes), reason, detail)
