"""A robot that asks for a graph all the time, and watches who leads; a process of its own.

It asks without retrying, as `HozClient` would, so that what it writes down is what the service does by itself.

    python -m tests.campaigns.prober --connect tcp/127.0.0.1:7447 --run NAME --out FILE
"""

import json
import os
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import IO, Any, Final

import click

from hoz_dist.cli.child import die_with_parent
from hoz_dist.wire.membership.liveliness import Members
from hoz_dist.wire.protocol.codec import decode
from hoz_dist.wire.protocol.graph_messages import SceneGraphReply
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.rejection import RejectedError
from hoz_dist.wire.protocol.run_messages import StatusReply
from hoz_dist.wire.transport.ask import ask
from hoz_dist.wire.transport.session import Session, open_client

ASK_EVERY_S: Final = 0.05
STATUS_EVERY: Final = 20
"""Questions between two for the status."""
LOOK_EVERY_S: Final = 0.01
ANSWER_S: Final = 2.0
MOST_AT_ONCE: Final = 128
CONNECT_S: Final = 60.0
SCENE: Final = "bathroom"


class _Notes:
    """Writes JSON lines from several threads."""

    def __init__(self, file: IO[str]) -> None:
        self._file, self._lock = file, threading.Lock()

    def write(self, **values: Any) -> None:
        with self._lock:
            self._file.write(json.dumps(values) + "\n")
            self._file.flush()


def _ask_graph(session: Session, keys: Keys, notes: _Notes | None) -> bool:
    """Ask once for the graph; tell whether it came, and write it down."""
    sent, began = time.time(), time.monotonic()
    answers = ask(session, keys.graph(SCENE), timeout_s=ANSWER_S)
    seconds = time.monotonic() - began
    answered = False
    for answer in answers:
        try:
            answered = decode(answer.payload, SceneGraphReply).scene == SCENE
        except RejectedError:
            continue
    if notes is not None:
        notes.write(what="graph", sent=sent, seconds=seconds, answered=answered)
    return answered


def _ask_status(session: Session, keys: Keys, notes: _Notes) -> None:
    sent = time.time()
    for answer in ask(session, keys.status, timeout_s=ANSWER_S):
        status = decode(answer.payload, StatusReply)
        notes.write(
            what="status",
            sent=sent,
            epoch=status.epoch,
            version=status.version,
            rejected=dict(status.rejected),
            duplicates=status.details.get("duplicates"),
        )


def _watch_leaders(members: Members, notes: _Notes, stop: threading.Event) -> None:
    known: list[list[object]] | None = None
    while not stop.wait(LOOK_EVERY_S):
        leaders: list[list[object]] = [[one.id, one.incarnation] for one in members.current() if one.role == "learner"]
        if leaders != known:
            notes.write(what="leaders", time=time.time(), leaders=leaders)
            known = leaders


@click.command()
@click.option("--connect", required=True)
@click.option("--run", required=True)
@click.option("--out", type=click.Path(path_type=Path), required=True)
def main(connect: str, run: str, out: Path) -> None:
    """Ask until SIGTERM."""
    die_with_parent(os.getppid())
    stop, keys = threading.Event(), Keys(run)
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    with (
        open_client(connect, CONNECT_S, stop) as session,
        Members(session, keys) as members,
        out.open("w", encoding="utf-8") as file,
        ThreadPoolExecutor(MOST_AT_ONCE) as threads,
    ):
        notes = _Notes(file)
        threads.submit(_watch_leaders, members, notes, stop)
        while not stop.wait(ASK_EVERY_S) and not _ask_graph(session, keys, None):
            pass  # no actor has explored a room yet
        asked, start = 0, time.monotonic()
        while not stop.wait(max(start + asked * ASK_EVERY_S - time.monotonic(), 0.0)):
            threads.submit(_ask_graph, session, keys, notes)
            if asked % STATUS_EVERY == 0:
                threads.submit(_ask_status, session, keys, notes)
            asked += 1


if __name__ == "__main__":
    main()
