"""The learner process: carries out on Zenoh, disk and TensorBoard what the core decides.

One thread, the one that calls `serve`, takes pushes from the server's bounded inbox, lets the core handle them, and
carries out the effects in order. Questions are answered by the server's threads from snapshots. Checkpoints are copied
in this thread and written in another. A disk that fails is said once in the log, and training goes on.
"""

import json
import logging
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

from hoz_dist.config import RunConfig
from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.sim.catalogue import CATALOGUE_PATH
from hoz_dist.wire.inbox import Request
from hoz_dist.wire.keys import Keys
from hoz_dist.wire.liveliness import Member, Members, declare_alive, host_name
from hoz_dist.wire.messages import (
    ConfigReply,
    EpisodesPush,
    GradientPush,
    Refused,
    RoomGraphPush,
    StatusReply,
)
from hoz_dist.wire.outage import Outage
from hoz_dist.wire.parameters import ParametersPublisher
from hoz_dist.wire.rejection import Reason
from hoz_dist.wire.rejections import Rejections
from hoz_dist.wire.server import Server
from hoz_dist.wire.session import Session, open_router
from hoz_dist.wire.snapshots import Snapshots
from learner.checkpoint_writer import CheckpointWriter
from learner.core import LearnerCore
from learner.events import (
    Effect,
    EpisodesReceived,
    Event,
    Finish,
    GradientReceived,
    PublishGraph,
    PublishParameters,
    RecordUpdate,
    Reply,
    RoomGraphReceived,
    SaveCheckpoint,
    Tick,
)
from learner.membership import left_processes, live_processes
from learner.recorder import ScalarRecorder, UpdateLog
from learner.replay import Schedule, read_updates
from learner.run_folder import RunFolder, open_run_folder

TICK_S: Final = 0.1
"""Longest time that the loop waits for a push."""
STATUS_S: Final = 0.5
"""Age at which the status that is served is renewed."""
RECORD_S: Final = 5.0
"""Time between two records in TensorBoard and the log."""
FAREWELL_S: Final = 5.0
"""How long a learner that exits when done stays to tell its actors."""
NAME: Final = "learner"
"""Role and name of the live token."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class LearnerSettings:
    """How one learner process works; what the whole run shares is in its configuration."""

    listen: str
    """Endpoint to listen at."""
    run: Path
    """The run's folder; its last part is the run's name on the network."""
    config: RunConfig
    checkpoint_seconds: float = 30.0
    replay: Path | None = None
    """Recorded updates to repeat."""
    exit_when_done: bool = False
    """Return when the budget is used up; otherwise graphs go on being served."""


def serve(settings: LearnerSettings, stop: threading.Event) -> None:
    """Run a learner until ``stop`` is set, or the budget is used up.

    Raises:
        HozError: The endpoint, the run folder or the recorded updates cannot be used.
    """
    name = settings.run.resolve().name
    keys = Keys(name)
    schedule = read_updates(settings.replay) if settings.replay is not None else None
    with (
        open_router(settings.listen) as session,
        open_run_folder(settings.run, settings.config) as folder,
        _log_to(folder.log),
    ):
        checkpoint = folder.checkpoint
        applied = checkpoint.version if checkpoint is not None else 0
        core = LearnerCore(
            settings.config,
            initial_parameters(settings.config.policy, settings.config.seed),
            epoch=folder.epoch,
            checkpoint=checkpoint,
            room_digests=catalogue_digests(),
            schedule=Schedule(schedule, applied) if schedule is not None else None,
            checkpoint_seconds=settings.checkpoint_seconds,
        )
        _log.info(
            "run %s, epoch %d, version %d (%d parameters): listening at %s",
            *(name, core.epoch, core.version, core.parameters.size, settings.listen),
        )
        with Learner(core, folder, session, keys) as learner:
            learner.run(stop, exit_when_done=settings.exit_when_done)


class Learner:
    """The shell around a core. Use it in a ``with`` statement; leaving it saves a checkpoint and stops serving."""

    def __init__(self, core: LearnerCore, folder: RunFolder, session: Session, keys: Keys) -> None:
        self._core = core
        self._folder = folder
        self._name = keys.run
        self._status = core.status(time.monotonic())
        self._rejections = Rejections()
        self._done_since: float | None = None
        self._updates_disk = Outage(_log, "cannot record updates (%s); training on", "updates are recorded again")
        self._scalars_disk = Outage(_log, "cannot log to TensorBoard (%s); training on", "logging to TensorBoard again")
        self._checkpoints = CheckpointWriter(folder.checkpoints, core.snapshot)
        with ExitStack() as stack:
            self._updates = UpdateLog(folder.updates, core.version)
            stack.callback(self._updates.close)
            self._scalars = ScalarRecorder(folder.tensorboard, core.statistics.frames)
            stack.callback(self._scalars.close)
            stack.callback(self._save_last)
            self._members = stack.enter_context(Members(session, keys))
            self._parameters = stack.enter_context(ParametersPublisher(session, keys))
            config = ConfigReply(self._name, core.epoch, TARGETS, core.config.to_json())
            snapshots = Snapshots(config, self.status, core.config.edge_cost)
            self._publish_parameters()
            graphs: list[RoomGraph | SceneGraph] = [*core.graphs.rooms.values(), *core.graphs.scenes.values()]
            # The last thing that opens: what it answers with is all there.
            self._server = stack.enter_context(
                Server(session, keys, snapshots, rejections=self._rejections, graphs=graphs)
            )
            stack.enter_context(declare_alive(session, keys, Member(NAME, NAME, host_name(), secrets.randbits(48))))
            self._open = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def run(self, stop: threading.Event, *, exit_when_done: bool) -> None:
        """Work until ``stop`` is set; or, if wanted, until the budget is used up and the actors have left."""
        renew_at = record_at = time.monotonic()
        while not stop.is_set() and not (exit_when_done and self._may_leave()):
            request = self._server.inbox.take(TICK_S)
            now = time.monotonic()
            if request is None:
                self._carry_out(self._core.handle(Tick(), now), None, now)
            else:
                self._handle(request, now)
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
            details={"run": self._name, **status},
        )

    def _handle(self, request: Request, now: float) -> None:
        try:
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
                case RecordUpdate(record):
                    self._updates.write(record)
                case SaveCheckpoint(keep):
                    self._flush_updates()
                    self._checkpoints.save(now, keep=keep)
                case Finish():
                    _log.info("the run is over at version %d; its last checkpoint will be kept", self._core.version)
                    self._done_since = now

    def _publish_parameters(self) -> None:
        self._parameters.publish(self._core.epoch, self._core.version, self._core.parameters)

    def _flush_updates(self) -> None:
        _write(self._updates.flush, self._updates_disk)

    def _save_last(self) -> None:
        """Save at a clean stop.

        Raises:
            HozError: It could not be written.
        """
        self._flush_updates()
        _log.info("stopped; saved %s", self._checkpoints.close(time.monotonic()))

    def _may_leave(self) -> bool:
        """Tell whether the run is over and every actor knows, or had the time to ask."""
        if self._done_since is None:
            return False
        actors_left = all(member.role == NAME for member in self._members.current())
        return actors_left or time.monotonic() - self._done_since > FAREWELL_S

    def _record(self, now: float) -> None:
        status = self._core.status(now)
        self._flush_updates()
        _write(lambda: self._scalars.record(status), self._scalars_disk)
        success, lag = status["success"]["overall"], status["lag"]
        _log.info(
            "%.3fM frames  %.0f frames/s  success %s  lag %.1f (max %d)  %d actors%s",
            status["frames"] / 1e6,
            status["frames_per_second"],
            "-" if success is None else f"{success:.0%}",
            lag["mean"],
            lag["max"],
            sum(member.role != NAME for member in self._members.current()),
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


def catalogue_digests() -> dict[str, str]:
    """Return the digest of every room of the catalogue, by room name, without making the rooms."""
    rooms: dict[str, dict[str, Any]] = json.loads(CATALOGUE_PATH.read_text(encoding="utf-8"))
    return {name: room["digest"] for name, room in rooms.items()}


def _event_of(request: Request) -> Event:
    match request.message:
        case GradientPush() as push:
            return GradientReceived(0, push)
        case EpisodesPush() as push:
            return EpisodesReceived(0, push)
        case RoomGraphPush() as push:
            return RoomGraphReceived(0, push)
        case push:
            raise TypeError(push)


class _LogFile(logging.FileHandler):
    """A log file whose disk may fill up; the console has the same lines."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the name is logging's
        """Lose the line."""


@contextmanager
def _log_to(path: Path) -> Iterator[None]:
    """Write what is logged into a file as well.

    Raises:
        InvalidValueError: The file cannot be written.
    """
    try:
        handler = _LogFile(path, encoding="utf-8")
    except OSError as error:
        message = f"Cannot write '{path}' ({error.strerror}); mend it or choose another run folder."
        raise InvalidValueError(message) from error
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    handler.setLevel(logging.INFO)
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)
        with suppress(OSError):
            handler.close()
