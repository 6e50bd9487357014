"""A standby: follows the leader of a run, and takes over when it is gone.

A leader that was killed has let go of the lock of its epoch: then nobody is in the way. One that stands still or whose
network is cut holds it; its token is given the time to come back, because the router may only have been restarted.
Taking over too early would be safe, since a deposed leader cannot change the run any more, but it costs what was
trained since the last checkpoint.
"""

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

from hoz_dist.errors import HozError
from hoz_dist.outage import Outage
from learner.checkpoint import Checkpoint, UnreadableError, checkpoint_files, load_checkpoint
from learner.leadership import Leadership
from learner.run_folder import RunFolder

FREE_S: Final = 0.3
"""How long the token of a leader that has let go of its lock must be away."""
STILL_S: Final = 1.5
"""How long that of a leader that holds its lock must be away, beyond the lease after which the router gave it up."""
RECONNECTED_S: Final = 4.0
"""The same after the network of this process was away: others try to come back every 2 s."""
STOOD_STILL_S: Final = 1.0
"""A standby that has not looked for so long stood still itself, and what it saw before is worth nothing."""
LOOK_S: Final = 0.05
RETRY_S: Final = 1.0
"""Time until a run that cannot be read is looked at again."""
READ_AHEAD_S: Final = 2.0
"""How often to look for a newer checkpoint to read ahead."""

_log = logging.getLogger(__name__)


class Sight(NamedTuple):
    """What a standby sees."""

    connected: bool
    """Whether this process has a router."""
    leader: bool
    """Whether a learner holds the token of a leader."""
    epoch: int = 0
    """The newest epoch; not looked at while there is a leader."""
    held: bool = False
    """Whether its leader holds the lock; likewise."""


class TakeOverRule:
    """Decides when a standby takes over, from what it sees. No input or output, no clock."""

    def __init__(self) -> None:
        self._away_since: float | None = None
        self._patience = RECONNECTED_S
        self._epoch = 0
        self._looked = float("-inf")

    def is_time(self, sight: Sight, now: float) -> bool:
        """Tell whether to take over.

        Args:
            sight: What is seen now.
            now: The time, seconds.
        """
        stood_still = now - self._looked > STOOD_STILL_S
        self._looked = now
        if stood_still or not sight.connected:
            # Nobody can be seen, and nobody could be served.
            self._away_since, self._patience = None, RECONNECTED_S
            return False
        if sight.leader:
            self._away_since, self._patience = None, STILL_S
            return False
        if self._away_since is None or sight.epoch != self._epoch:
            # Whoever claimed an epoch just now is about to show its token.
            self._away_since, self._epoch = now, sight.epoch
        return now - self._away_since >= (self._patience if sight.held else FREE_S)


class ReadAhead:
    """Keeps the newest checkpoint of a run read, so that taking over does not wait for the disk.

    Args:
        folder: The folder of checkpoints.
        heard: Told of each checkpoint that was read.
    """

    def __init__(self, folder: Path, heard: Callable[[Checkpoint], None] | None = None) -> None:
        self._folder = folder
        self._heard = heard
        self._identity: tuple[object, ...] = ()
        self._checkpoint: Checkpoint | None = None

    def refresh(self) -> None:
        """Read the newest checkpoint, if it is another one than before; nothing that is wrong with it matters yet."""
        try:
            files = checkpoint_files(self._folder)
            if files and _identity(files[0]) != self._identity:
                self.read(files[0])
        except (HozError, OSError) as error:
            _log.debug("cannot read a checkpoint ahead: %s", error)

    def read(self, path: Path) -> Checkpoint:
        """Return a checkpoint, without reading it when that was done before; as `load_checkpoint`."""
        identity = _identity(path)
        if self._checkpoint is None or identity != self._identity:
            self._checkpoint, self._identity = load_checkpoint(path), identity
            if self._heard is not None:
                self._heard(self._checkpoint)
        return self._checkpoint

    def forget(self) -> None:
        """Read anew next time, whatever was read before."""
        self._checkpoint, self._identity = None, ()


def follow(
    folder: RunFolder, sight: Callable[[], tuple[bool, bool]], ahead: ReadAhead, stop: threading.Event
) -> Leadership | None:
    """Wait until it is time to take over, and claim the run; nothing is claimed that could not be taken over.

    Args:
        folder: The run folder.
        sight: Tells whether this process has a router, and whether a leader's token is there.
        ahead: What to keep read meanwhile.
        stop: Ends the wait.

    Returns:
        The leadership; None when ``stop`` was set.

    Raises:
        HozError: The run has another configuration, every checkpoint is damaged, or its folder cannot be written.
    """
    rule, read_at = TakeOverRule(), time.monotonic()
    outage = Outage(_log, "%s This standby goes on trying.", "the run can be read again")
    while not stop.is_set():
        try:
            seen, now = _look(folder, *sight()), time.monotonic()
            if rule.is_time(seen, now):
                folder.check_going_on(ahead.read)
                outage.worked()
                leadership = folder.claim(seen.epoch)
                if leadership is not None:
                    return leadership
        except UnreadableError as error:
            outage.failed(error)
            stop.wait(RETRY_S)
            continue
        if seen.leader:
            outage.worked()
            if now >= read_at:
                ahead.refresh()
                read_at = time.monotonic() + READ_AHEAD_S
        stop.wait(LOOK_S)
    return None


def _look(folder: RunFolder, connected: bool, leader: bool) -> Sight:  # noqa: FBT001 - as `Sight`
    if not connected or leader:
        return Sight(connected, leader)
    epoch = folder.newest_epoch()
    return Sight(connected, leader, epoch, folder.is_held(epoch))


def _identity(path: Path) -> tuple[object, ...]:
    """Return what tells a file from another one of the same name."""
    try:
        status = path.stat()
    except FileNotFoundError:
        return (path,)
    return path, status.st_ino, status.st_mtime_ns, status.st_size
