"""Asks for the status again and again, whatever becomes of the learner and the router, and shows each renewal."""

import json
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import datetime
from types import TracebackType
from typing import Any, NamedTuple, Protocol, Self

import click
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.text import Text

from hoz_dist.cli.status_text import status_line, status_page
from hoz_dist.errors import ConnectionFailedError, HozError, NotFoundError


class Client(Protocol):
    """What is watched: a `HozClient`."""

    def status(self) -> dict[str, Any]:
        """Return the status of the run."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class Look(NamedTuple):
    """What one renewal found."""

    time: datetime
    status: dict[str, Any] | None
    """The newest status that is known; None before the first."""
    silent_since: datetime | None = None
    """Since when no learner answers; None while one does."""
    problem: str = ""
    """Why there is no answer, one sentence."""


class Watcher:
    """Asks for the status. Use it in a ``with`` statement.

    Args:
        connect: Opens a client; tried again as long as nobody is there. An open client reconnects by itself.
        now: The time of day.
    """

    def __init__(
        self, connect: Callable[[], Client], now: Callable[[], datetime] = lambda: datetime.now().astimezone()
    ) -> None:
        self._connect = connect
        self._now = now
        self._client: Client | None = None
        self._status: dict[str, Any] | None = None
        self._silent_since: datetime | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._client is not None:
            self._client.close()

    def look(self) -> Look:
        """Ask once.

        Raises:
            HozError: Asking again would not help: the endpoint or the run is not what the user thinks. Once a learner
                has answered, nothing is taken for that bad any more.
        """
        asked = self._now()
        try:
            if self._client is None:
                self._client = self._connect()
            self._status = self._client.status()
        except HozError as error:
            if self._status is None and not isinstance(error, ConnectionFailedError | NotFoundError):
                raise
            self._silent_since = self._silent_since or asked
            return Look(self._now(), self._status, self._silent_since, str(error))
        self._silent_since = None
        return Look(self._now(), self._status)


class Page(AbstractContextManager["Page"]):
    """Shows the newest look in place, on a terminal; the last one stays in sight."""

    def __init__(self, console: Console) -> None:
        self._live = Live(console=console, auto_refresh=False)

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def show(self, look: Look) -> None:
        """Replace what is shown."""
        self._live.update(look_page(look), refresh=True)


def watch(watcher: Watcher, show: Callable[[Look], None], every: float) -> None:
    """Look and show, until interrupted.

    Args:
        watcher: What looks.
        show: What shows.
        every: Time from one renewal to the next, seconds.
    """
    while True:
        began = time.monotonic()
        show(watcher.look())
        time.sleep(max(every - (time.monotonic() - began), 0.0))


def look_page(look: Look) -> RenderableType:
    """Lay out a look for a terminal: what is known stays in sight while no learner answers."""
    # First what must not be cut off where the terminal is too low for all of it.
    parts: list[RenderableType] = [Text(f"{look.time:%H:%M:%S}  Ctrl-C ends")]
    if look.silent_since is not None:
        parts.append(Text(_silence(look), style="bold"))
    if look.status is not None:
        parts.append(status_page(look.status))
    return Group(*parts)


def print_line(look: Look) -> None:
    """Print a look as a line, for a log."""
    answered = look.status is not None and look.silent_since is None
    text = status_line(look.status) if answered and look.status is not None else _silence(look)
    click.echo(f"{look.time:%H:%M:%S} {text}")


def print_json(look: Look) -> None:
    """Print a look as a JSON object on a line: the status, or since when there is none."""
    if look.silent_since is None:
        fields: dict[str, Any] = look.status or {}
    else:
        fields = {"silent_since": look.silent_since.isoformat(timespec="seconds"), "problem": look.problem}
    click.echo(json.dumps({"time": look.time.isoformat(timespec="seconds"), **fields}))


def _silence(look: Look) -> str:
    return f"no learner answers since {look.silent_since:%H:%M:%S}: {look.problem}"
