"""Work in processes of its own: benchmarks, which need the environment that learners and actors run in."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

from hoz_dist.cli.progress import Progress
from hoz_dist.errors import HozError
from hoz_dist.wire.transport.environment import child_environment

START_S: Final = 60.0
"""How long a companion may take to be ready, seconds."""
STOP_S: Final = 10.0
"""How long a companion may take to stop before it is killed, seconds."""
T = TypeVar("T")
_READY: Final = "ready"
_STOP: Final = "stop"


class _Told(NamedTuple):
    """How far the work is."""

    done: float
    total: float
    note: str


class _Result(NamedTuple):
    """What came of it."""

    value: Any


class _Failure(NamedTuple):
    """Why nothing came of it, in a sentence."""

    sentence: str


def work_apart(title: str, work: Callable[..., T]) -> T:
    """Do some work in a process of its own and show its progress.

    Args:
        title: What is being done, for the progress.
        work: Takes ``progress``, a function of what is done, what there is to do, and a note; it and its result are
            handed from process to process.

    Raises:
        HozError: It failed.
    """
    with _started(_work, work) as (process, connection), Progress(title, 1.0, None) as progress:
        while True:
            try:
                message = connection.recv()
            except EOFError:
                process.join()
                raise _ended(process) from None
            match message:
                case _Told(done, total, note):
                    progress.update(done, note, total=total)
                case _Failure(sentence):
                    raise HozError(sentence)
                case _Result(value):
                    result: T = value
                    return result


class Companion:
    """A process that serves.

    Args:
        process: The process.
        connection: What it says, and is told.
    """

    def __init__(self, process: BaseProcess, connection: Connection) -> None:
        self._process = process
        self._connection = connection

    def check(self) -> None:
        """Look whether it still serves.

        Raises:
            HozError: It failed or ended.
        """
        if self._connection.poll():
            self._listen()
            raise _ended(self._process)

    def await_ready(self) -> None:
        """Wait until it serves.

        Raises:
            HozError: It failed, or does not serve in time.
        """
        if not self._connection.poll(START_S):
            message = f"A process of the benchmark did not start within {START_S:g} s."
            raise HozError(message)
        if not self._listen():
            raise _ended(self._process)

    def pause(self) -> None:
        """Let it stand still; it should see to it itself that it dies with this process."""
        self._signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Let it go on after `pause`."""
        self._signal(signal.SIGCONT)

    def run_on(self, cores: Iterable[int]) -> None:
        """Let all of its threads run on these cores alone.

        Raises:
            OSError: The system does not allow it.
        """
        if self._process.is_alive():
            for thread in Path(f"/proc/{self._process.pid}/task").iterdir():
                with suppress(ProcessLookupError):  # of a thread that has just ended
                    os.sched_setaffinity(int(thread.name), cores)

    def stop(self) -> None:
        """Tell it to stop, and wait until it has.

        Raises:
            HozError: It failed, now or before.
        """
        self.resume()  # one that stands still hears nothing
        with suppress(BrokenPipeError):
            self._connection.send(_STOP)
        while self._connection.poll(STOP_S):
            if not self._listen():
                if self._process.exitcode:
                    raise _ended(self._process)
                break

    def _signal(self, number: signal.Signals) -> None:
        if self._process.is_alive() and self._process.pid is not None:
            os.kill(self._process.pid, number)

    def _listen(self) -> bool:
        """Hear what it says; False when it has ended.

        Raises:
            HozError: It failed.
        """
        try:
            said = self._connection.recv()
        except (EOFError, ConnectionResetError):  # the latter from one that was killed before it heard all
            self._process.join()
            return False
        if isinstance(said, _Failure):
            raise HozError(said.sentence)
        return True


@contextmanager
def companion(serve: Callable[..., None]) -> Iterator[Companion]:
    """Let a process of its own serve during a ``with`` statement.

    Args:
        serve: Takes ``ready``, to be called once it serves, and ``stopped``, which waits some seconds for the word to
            stop and tells whether it came; it comes also when this process dies.

    Raises:
        HozError: It failed; at the end of the statement, if not before.
    """
    with _started(_serve, serve) as (process, connection):
        served = Companion(process, connection)
        served.await_ready()
        yield served
        served.stop()


@contextmanager
def _started(
    body: Callable[[Connection, Callable[..., Any]], None], work: Callable[..., Any]
) -> Iterator[tuple[BaseProcess, Connection]]:
    """Run ``body`` in a process that ends with the ``with`` statement."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=body, args=(theirs, work), daemon=True)
    with _environment():
        process.start()
    theirs.close()
    try:
        yield process, ours
    finally:
        process.kill()  # also one that stands still
        process.join()
        ours.close()


@contextmanager
def _environment() -> Iterator[None]:
    """Give this process the environment of learners and actors, for those that it starts."""
    before = dict(os.environ)
    os.environ.update(child_environment())
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _work(connection: Connection, work: Callable[..., Any]) -> None:
    """Do the work; the body of its process."""
    _leave_signals_to_parent()

    def progress(done: float, total: float, note: str) -> None:
        connection.send(_Told(done, total, note))

    try:
        connection.send(_Result(work(progress=progress)))
    except HozError as error:
        connection.send(_Failure(str(error)))


def _serve(connection: Connection, serve: Callable[..., None]) -> None:
    """Serve; the body of a companion."""
    _leave_signals_to_parent()
    try:
        # The word to stop is never read, so that it stays; a closed connection, too, has something to tell.
        serve(ready=lambda: connection.send(_READY), stopped=connection.poll)
    except HozError as error:
        connection.send(_Failure(str(error)))


def _leave_signals_to_parent() -> None:
    # Ctrl-C reaches all processes of a terminal; the parent ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _ended(process: BaseProcess) -> HozError:
    return HozError(f"A process of the benchmark ended with exit status {process.exitcode}; its words stand above.")
