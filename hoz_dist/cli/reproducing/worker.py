"""A process that works for `hoz-dist reproduce`, and dies with the command."""

import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from typing import Any, Final, NamedTuple

from hoz_dist.cli.child import die_with_parent
from hoz_dist.cli.main import sentence_of
from hoz_dist.cli.processes import STOP_S
from hoz_dist.cli.spawning import start_shielded
from hoz_dist.errors import HozError

OUR_MISTAKE: Final = "A process of this command failed by a mistake of ours; what it says is above."
"""Said when a process ended with a status above 0 and sent no `Failure`; below 0 a signal killed it."""


class Failure(NamedTuple):
    """The last that a process sends when its work failed."""

    sentence: str
    """What went wrong."""


class Worker:
    """A process that works for the command; `receive` what it sends until it has ended.

    Args:
        context: Starts processes anew, so that they share nothing with this one.
        work: What it does; called with the arguments and the function that sends.
        arguments: Of ``work``.
    """

    def __init__(self, context: SpawnContext, work: Callable[..., None], *arguments: object) -> None:
        self._receiving, sending = context.Pipe(duplex=False)
        self._process = context.Process(target=_run, args=(work, arguments, sending, os.getpid()))
        start_shielded([self._process])
        sending.close()

    @property
    def connection(self) -> Connection:
        """Becomes ready when there is something to receive, or the process has ended."""
        return self._receiving

    @property
    def exit_status(self) -> int | None:
        """None while it runs."""
        return self._process.exitcode

    def receive(self) -> list[Any]:
        """Return what it has sent since the last call."""
        received = []
        with suppress(EOFError, OSError):
            while self._receiving.poll():
                received.append(self._receiving.recv())
        return received

    def terminate(self) -> None:
        """Ask it to stop."""
        self._process.terminate()

    def join(self) -> None:
        """Wait until it has stopped; kill it if that takes too long: its own children take `STOP_S` each at most."""
        self._process.join(3 * STOP_S)
        if self._process.exitcode is None:
            self._process.kill()
            self._process.join()
        self._receiving.close()


def _run(work: Callable[..., None], arguments: Sequence[Any], sending: Connection, parent: int) -> None:
    """Work until done, failed or told to stop; the body of a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    die_with_parent(parent)
    sys.stdout = sys.stderr  # the command's standard output is its result
    status, stopped = 0, False
    try:
        work(*arguments, sending.send)
    except KeyboardInterrupt:
        stopped = True
    except (HozError, OSError) as error:
        sending.send(Failure(sentence_of(error)))
        status = 1
    # Its children have stopped. From here on SIGTERM ends it as it ends any process: not as a failure.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if stopped:
        os.kill(os.getpid(), signal.SIGTERM)
    sys.exit(status)
