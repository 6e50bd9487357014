"""Serving a run that this process leads: carries out on Zenoh, disk and TensorBoard what the core decides.

One thread, the one that calls `Learner.run`, takes pushes from the server's bounded inbox, lets the core handle them,
and carries out the effects in order. Questions are answered by the server's threads from snapshots. Checkpoints are
copied in this thread and written in another. A disk that fails is said once in the log, and training goes on.
"""

import logging
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Final, Self

from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.outage import Outage
from hoz_dist.stages import StageClock
from hoz_dist.wire.membership.liveliness import Member, Members
from hoz_dist.wire.protocol.answers import Refused
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.rejections import Rejections
from hoz_dist.wire.protocol.run_messages import ConfigReply, StatusReply
from hoz_dist.wire.protocol.trajectories import TrajectoryPush, most_bytes
from hoz_dist.wire.serving.inbox import Inbox, Request
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.session import Session
from hoz_dist.wire.transport.shared_memory import SharedMemory
from learner.checkpoint import Checkpoint
from learner.checkpoint_writer import CheckpointWriter
from learner.core import LearnerCore
from learner.events import (
    Effect,
    EpisodesReceived,
    Event,
    Finish,
    GradientReceived,
    OpenRoom,
    PublishGraph,
    PublishParameters,
    RecordUpdate,
    Reply,
    RoomGraphReceived,
    SaveCheckpoint,
    Tick,
    TrajectoryReceived,
)
from learner.leadership import DeposedError
from learner.membership import left_processes, live_processes
from learner.recorder import ScalarRecorder, UpdateLog
from learner.rooms import RoomOpener
from learner.run_folder import LedRun

TICK_S: Final = 0.1
"""Longest time that the loop waits for a push."""
LOOK_S: Final = 0.05
"""A push is handled only by a learner that has looked so recently whether it still leads."""
STATUS_S: Final = 0.5
"""Age at which the status that is served is renewed."""
RECORD_S: Final = 5.0
"""Time between two records in TensorBoard and the log."""
FAREWELL_S: Final = 5.0
"""How long a learner that exits when done stays to tell its actors."""
ACTOR: Final = "actor"
"""Role of the processes that train."""

_log = logging.getLogger(__name__)


class Learner:
    """The shell around a core. Use it in a ``with`` statement; leaving it stops serving, and saves a checkpoint.

    Args:
        core: What decides.
        run: The run, which this process leads.
        session: Session to serve on.
        keys: Keys of the run.
        members: Who takes part.
        me: This process, as the others see it.
        memory: Shared memory for parameters.
        rooms: Opens rooms, if the run learns from rollouts; stays open.
    """

    def __init__(
        self,
        core: LearnerCore,
        run: LedRun,
        session: Session,
        keys: Keys,
        members: Members,
        me: Member,
        memory: SharedMemory | None = None,
        rooms: RoomOpener | None = None,
    ) -> None:
        self._core = core
        self._leadership = run.leadership
        self._looked_at = time.monotonic()
        self._deposed = False
        self._name = keys.run
        self._members = members
        self._leader = {"name": me.id, "host": me.host}
        self._status = core.status(time.monotonic())
        self._rejections = Rejections()
        self._inbox = Inbox()
        self._clock = StageClock()
        self._done_since: float | None = None
        self._updates_disk = Outage(_log, "cannot record updates (%s); training on", "updates are recorded again")
        self._scalars_disk = Outage(_log, "cannot log to TensorBoard (%s); training on", "logging to TensorBoard again")
        with ExitStack() as stack:
            self._rooms = rooms
            for room in core.rooms_to_open():
                self._open_room(room)
            self._updates = UpdateLog(run.updates)
            stack.callback(self._updates.close)
            self._checkpoints = CheckpointWriter(
                run.folder.checkpoints, self._snapshot, run.leadership, self._updates.sync
            )
            self._scalars = ScalarRecorder(run.folder.tensorboard, core.statistics.frames)
            stack.callback(self._scalars.close)
            stack.callback(self._save_last)
            self._parameters = stack.enter_context(
                ParametersPublisher(session, keys, self._rejections, memory=memory, clock=self._clock)
            )
            config = ConfigReply(self._name, core.epoch, TARGETS, core.config.to_json())
            snapshots = Snapshots(config, self.status, core.config.edge_cost)
            self._publish_parameters()
            graphs: list[RoomGraph | SceneGraph] = [*core.graphs.rooms.values(), *core.graphs.scenes.values()]
            # The last thing that opens: what it answers with is all there.
            self._server = stack.enter_context(
                Server(
                    session,
                    keys,
                    snapshots,
                    rejections=self._rejections,
                    graphs=graphs,
                    inbox=self._inbox,
                    parameters=core.parameters.size,
                    rollout_bytes=most_bytes(core.config.batch, core.config.rollout_steps),
                    clock=self._clock,
                )
            )
            self._open = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    @property
    def deposed(self) -> bool:
        """Whether another learner was found to lead."""
        return self._deposed

    def run(self, stop: threading.Event, *, exit_when_done: bool) -> None:
        """Work until ``stop`` is set or another learner leads; or, if wanted, until the run is over and known to be."""
        renew_at = record_at = time.monotonic()
        while not stop.is_set() and not (exit_when_done and self._may_leave()):
            with self._clock("idle"):
                request = self._inbox.take(TICK_S)
            now = time.monotonic()
            # After the wait, and before the push is handled: this process may have stood still in between.
            if not self._leads(now):
                return
            for news in self._rooms.news() if self._rooms is not None else ():
                self._carry_out(self._core.handle(news, now), None, now)
            if request is None:
                self._carry_out(self._core.handle(Tick(), now), None, now)
            else:
                self._handle(request, now)
            with self._clock("record"):
                self._checkpoints.poll(now)
                if now >= renew_at:
                    self._status = self._core.status(now)
                    renew_at = now + STATUS_S
                if now >= record_at:
                    self._record(now)
                    record_at = now + RECORD_S

    def status(self) -> StatusReply:
        """Return the status that is served; called by the server's threads."""
        status = dict(self._status)
        actors, rejected = status.pop("actors"), self._rejections.by_sender()
        return StatusReply(
            version=status.pop("version"),
            epoch=status.pop("epoch"),
            processes=live_processes(self._members, actors, rejected),
            left=left_processes(self._members),
            rejected=self._rejections.by_reason(),
            details={
                "run": self._name,
                "leader": self._leader,
                "busy": self._inbox.put_off,
                "timings": self._clock.to_json(),
                **status,
            },
        )

    def _handle(self, request: Request, now: float) -> None:
        try:
            # What a rollout takes is its gradient; applying it is a small part of that.
            with self._clock("differentiate" if isinstance(request.message, TrajectoryPush) else "apply"):
                effects = self._core.handle(_event_of(request), now)
        except Exception:  # noqa: BLE001 - logged in full
            # Whatever a push manages to provoke must not stop the training, here and after each restart.
            _log.exception("failed to handle a push of %s", request.message.actor)
            request.answer(
                Refused(Reason.INTERNAL.value, "the learner failed to handle the push; see its log", self._core.epoch)
            )
        else:
            self._carry_out(effects, request, now)

    def _carry_out(self, effects: list[Effect], request: Request | None, now: float) -> None:
        for effect in effects:
            match effect:
                case Reply(answer=answer):
                    assert request is not None  # noqa: S101 - only requests are answered
                    request.answer(answer)
                case PublishParameters():
                    self._publish_parameters()
                case PublishGraph(room):
                    self._server.put_graph(self._core.graphs.rooms[str(room)])
                    self._server.put_graph(self._core.graphs.scenes[room.scene])
                case OpenRoom(room):
                    self._open_room(room)
                case RecordUpdate(record):
                    with self._clock("record"):
                        self._updates.write(record)
                case SaveCheckpoint(keep):
                    with self._clock("record"):
                        self._checkpoints.save(now, keep=keep)
                case Finish():
                    _log.info("the run is over at version %d; its last checkpoint will be kept", self._core.version)
                    self._done_since = now

    def _open_room(self, room: RoomId) -> None:
        if self._rooms is not None:
            self._rooms.want(room)

    def _publish_parameters(self) -> None:
        with self._clock("publish"):
            self._parameters.publish(self._core.epoch, self._core.version, self._core.parameters)

    def _snapshot(self, now: float) -> Checkpoint:
        # The record must have every update that a checkpoint has: the next learner's begins with the version after. It
        # is on the disk before the checkpoint is: the thread that writes waits for that.
        self._updates.flush()
        return self._core.snapshot(now)

    def _leads(self, now: float) -> bool:
        """Look whether this process still leads, unless it just did."""
        if now - self._looked_at > LOOK_S:
            self._deposed = self._leadership.deposed
            self._looked_at = time.monotonic()
        return not self._deposed

    def _save_last(self) -> None:
        """Save at a clean stop.

        Raises:
            HozError: It could not be written.
        """
        if self._deposed:
            self._checkpoints.abandon()
            return
        try:
            _log.info("stopped; saved %s", self._checkpoints.close(time.monotonic()))
        except DeposedError:
            self._deposed = True

    def _may_leave(self) -> bool:
        """Tell whether the run is over and every actor knows, or had the time to ask."""
        if self._done_since is None:
            return False
        return not self._actors() or time.monotonic() - self._done_since > FAREWELL_S

    def _actors(self) -> int:
        return sum(member.role == ACTOR for member in self._members.current())

    def _record(self, now: float) -> None:
        status = self._core.status(now)
        _write(self._updates.flush, self._updates_disk)
        _write(lambda: self._scalars.record(status), self._scalars_disk)
        success, lag = status["success"]["overall"], status["lag"]
        _log.info(
            "%.3fM frames  %.0f frames/s  success %s  lag %.1f (max %d)  %d actors%s",
            status["frames"] / 1e6,
            status["frames_per_second"],
            "-" if success is None else f"{success:.0%}",
            lag["mean"],
            lag["max"],
            self._actors(),
            "" if status["seconds_left"] is None else f"  {status['seconds_left']:.0f} s left",
        )


def _write(write: Callable[[], None], disk: Outage) -> None:
    """Write something without which training can go on."""
    try:
        write()
    except OSError as error:
        disk.failed(error)
    else:
        disk.worked()


def _event_of(request: Request) -> Event:
    match request.message:
        case GradientPush() as push:
            return GradientReceived(0, push)
        case EpisodesPush() as push:
            return EpisodesReceived(0, push)
        case RoomGraphPush() as push:
            return RoomGraphReceived(0, push)
        case TrajectoryPush() as push:
            return TrajectoryReceived(0, push)
        case push:
            raise TypeError(push)
