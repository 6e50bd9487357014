"""The learner process: connects, and leads the run, follows who leads it, or does the one after the other."""

import json
import logging
import secrets
import threading
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from hoz_dist.config import RunConfig
from hoz_dist.errors import ConnectionFailedError, InvalidValueError
from hoz_dist.graph.matching import match
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.sim.catalogue import CATALOGUE_PATH
from hoz_dist.waiting import StoppedError
from hoz_dist.wire.membership.liveliness import Member, Members, declare_alive, host_name
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.transport.session import Session, is_connected, open_client, open_router
from hoz_dist.wire.transport.settings import SERVICE_LEASE_MS
from hoz_dist.wire.transport.shared_memory import SharedMemory
from learner.checkpoint import Checkpoint, UnreadableError
from learner.core import LearnerCore
from learner.leadership import DeposedError, Leadership
from learner.log_file import logged_to
from learner.replay import Schedule, read_updates
from learner.rollout_gradients import RolloutGradients
from learner.rooms import RoomOpener, RoomSource
from learner.run_folder import RunFolder
from learner.serving import Learner
from learner.standby import RETRY_S, ReadAhead, follow

if TYPE_CHECKING:
    from hoz_dist.wire.transport.credentials import Credentials

CONNECT_S: Final = 30.0
"""How long a learner that is no standby tries to reach its router, seconds; it may be starting."""
ATTEMPT_S: Final = 5.0
"""How long a standby tries before it says so, seconds; then it goes on trying."""
SHARDS_SHARED: Final = 16
"""Shards of parameters that fit into shared memory: each actor takes one at a time."""
LEADER: Final = "learner"
STANDBY: Final = "standby"

_log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class LearnerSettings:
    """How one learner process works; what the whole run shares is in its configuration."""

    listen: str | None = None
    """Endpoint to listen at, as a router; None to connect to one."""
    connect: str | None = None
    """Endpoint of a router; needed without ``listen``."""
    credentials: "Credentials | None" = None
    name: str = field(default_factory=host_name)
    """Name of this process on the network and in the log."""
    standby: bool = False
    """Wait while another learner leads the run; needs ``connect``. Without, that is an error."""
    run: Path
    """The run's folder; its last part is the run's name on the network."""
    config: RunConfig
    shared_memory: bool = False
    """Hand over large messages to processes of this host through shared memory."""
    checkpoint_seconds: float = 30.0
    keep_every: int | None = None
    """Frames between checkpoints that are never deleted; None for none but the last."""
    replay: Path | None = None
    """Recorded updates to repeat."""
    rooms: RoomSource | None = None
    """Where the views of rooms come from; needed by a run that learns from rollouts."""
    exit_when_done: bool = False
    """Return when the budget is used up; otherwise graphs go on being served."""

    def __post_init__(self) -> None:
        """Check what would leave every rollout waiting for ever.

        Raises:
            InvalidValueError: The run learns from rollouts, and there is nowhere to take the views of rooms from.
        """
        if self.config.learn_from == "rollouts" and self.rooms is None:
            message = "A learner that learns from rollouts must see their rooms: give it a source of views."
            raise InvalidValueError(message)


def serve(settings: LearnerSettings, stop: threading.Event) -> None:
    """Run a learner until ``stop`` is set, or the budget is used up.

    Raises:
        HozError: The endpoint, the run folder or the recorded updates cannot be used, another learner leads the run,
            or has taken it over.
    """
    keys = Keys(settings.run.resolve().name)
    folder = RunFolder(settings.run, settings.config)
    folder.check()
    cores = _Cores(settings)
    with (
        suppress(StoppedError),
        SharedMemory(on=settings.shared_memory, messages=SHARDS_SHARED) as memory,
        _opened(settings, memory, stop) as session,
        nullcontext() if settings.rooms is None else RoomOpener(settings.rooms) as rooms,
    ):
        folder.make()
        ahead = ReadAhead(folder.checkpoints, rooms.want_those_of if rooms is not None else None)
        leadership = None if settings.standby else folder.claim_or_refuse(ahead.read)
        with leadership or nullcontext(), logged_to(folder.log, settings.name), Members(session, keys) as members:
            _Turns(settings, folder, session, keys, members, cores, memory, rooms).take(leadership, ahead, stop)


class _Cores:
    """Makes the core of an epoch, without delay."""

    def __init__(self, settings: LearnerSettings) -> None:
        self._settings = settings
        self._records = read_updates(settings.replay) if settings.replay is not None else None
        self._initial = initial_parameters(settings.config.policy, settings.config.seed)
        self._room_digests = catalogue_digests()
        config = settings.config
        self._rollouts = RolloutGradients(config) if config.learn_from == "rollouts" else None
        # For nothing but to have it done: with the first optimizer torch imports seconds' worth of modules, with
        # the first merge of rooms comes scipy.optimize, and nobody shall wait for them who waits for a leader.
        self.make(0, None)
        match(np.eye(2), np.eye(2))

    def make(self, epoch: int, checkpoint: Checkpoint | None) -> LearnerCore:
        """Return the core of an epoch that goes on from a checkpoint, or begins the run."""
        applied = checkpoint.version if checkpoint is not None else 0
        return LearnerCore(
            self._settings.config,
            self._initial,
            epoch=epoch,
            checkpoint=checkpoint,
            room_digests=self._room_digests,
            schedule=Schedule(self._records, applied) if self._records is not None else None,
            checkpoint_seconds=self._settings.checkpoint_seconds,
            keep_every=self._settings.keep_every,
            rollouts=self._rollouts,
        )


class _Turns:
    """A process that leads and follows in turns."""

    def __init__(
        self,
        settings: LearnerSettings,
        folder: RunFolder,
        session: Session,
        keys: Keys,
        members: Members,
        cores: _Cores,
        memory: SharedMemory,
        rooms: RoomOpener | None = None,
    ) -> None:
        self._settings = settings
        self._folder = folder
        self._session = session
        self._keys = keys
        self._members = members
        self._cores = cores
        self._memory = memory
        self._rooms = rooms
        self._incarnation = secrets.randbits(48)

    def take(self, leadership: Leadership | None, ahead: ReadAhead, stop: threading.Event) -> None:
        """Lead or follow until ``stop`` is set, or the run is over.

        Args:
            leadership: The right to begin with leading; None to begin with following.
            ahead: What keeps the newest checkpoint read.
            stop: Ends both.

        Raises:
            DeposedError: Another learner leads, and this process, being its own router, cannot follow.
            UnreadableError: A learner that is no standby cannot read the run.
        """
        while True:
            follows = leadership is None
            if leadership is None:
                leadership = self._follow(ahead, stop)
            try:
                if leadership is None or not self._lead(leadership, ahead, stop):
                    return
            except UnreadableError as error:
                # It could be read when the epoch was claimed; before the next is, it must be again.
                if not follows:
                    raise
                _log.warning("%s This standby goes on trying.", error)
                leadership = None
                ahead.forget()
                stop.wait(RETRY_S)
                continue
            _log.warning("deposed: another learner leads run %s after epoch %d", self._keys.run, leadership.epoch)
            if self._settings.connect is None:
                raise DeposedError(self._folder.path, leadership.epoch)
            leadership = None
            ahead.forget()

    def _follow(self, ahead: ReadAhead, stop: threading.Event) -> Leadership | None:
        """Follow the leader; return the right to lead, or None when ``stop`` was set."""
        with declare_alive(self._session, self._keys, self._member(STANDBY)):
            _log.info("follows run %s as a standby", self._keys.run)
            return follow(self._folder, self._sight, ahead, stop)

    def _lead(self, leadership: Leadership, ahead: ReadAhead, stop: threading.Event) -> bool:
        """Lead the run; return whether another learner has taken it over."""
        settings, me = self._settings, self._member(LEADER)
        # The token is there as long as the leadership is: standbys leave a leader alone that reads or saves for long.
        with leadership, declare_alive(self._session, self._keys, me):
            try:
                run = self._folder.take_over(leadership, ahead.read)
            except DeposedError:
                return True
            core = self._cores.make(leadership.epoch, run.checkpoint)
            _log.info(
                "leads run %s, epoch %d, from version %d (%d parameters): %s",
                *(self._keys.run, core.epoch, core.version, core.parameters.size),
                f"listening at {settings.listen}" if settings.listen else f"connected to {settings.connect}",
            )
            with Learner(core, run, self._session, self._keys, self._members, me, self._memory, self._rooms) as learner:
                learner.run(stop, exit_when_done=settings.exit_when_done)
            return learner.deposed

    def _sight(self) -> tuple[bool, bool]:
        """Tell whether there is a router, and a leader."""
        others = (member for member in self._members.current() if member.incarnation != self._incarnation)
        return is_connected(self._session), any(member.role == LEADER for member in others)

    def _member(self, role: str) -> Member:
        return Member(role, self._settings.name, host_name(), self._incarnation)


def catalogue_digests() -> dict[str, str]:
    """Return the digest of every room of the catalogue, by room name, without making the rooms."""
    rooms: dict[str, dict[str, Any]] = json.loads(CATALOGUE_PATH.read_text(encoding="utf-8"))
    return {name: room["digest"] for name, room in rooms.items()}


def _opened(settings: LearnerSettings, memory: SharedMemory, stop: threading.Event) -> Session:
    """Open the session.

    Raises:
        HozError: It cannot be opened.
        StoppedError: ``stop`` was set while the router was waited for.
    """
    if settings.listen is not None:
        return open_router(settings.listen, settings.credentials, shared_memory=memory.on)
    connect = settings.connect or ""
    if not settings.standby:
        return open_client(connect, CONNECT_S, stop, settings.credentials, SERVICE_LEASE_MS, shared_memory=memory.on)
    waits = False
    while True:
        try:
            return open_client(
                connect, ATTEMPT_S, stop, settings.credentials, SERVICE_LEASE_MS, shared_memory=memory.on
            )
        except ConnectionFailedError as error:
            if not waits:
                _log.warning("%s Waiting for it.", error)
            waits = True
