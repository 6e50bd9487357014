"""Many actors that do nothing but push gradients, and write down every answer; one process.

    python -m tests.campaigns.pushers --connect tcp/127.0.0.1:7447 --run NAME --out FILE --actors 24

Until SIGTERM each goes on to the next gradient as soon as the learner has said what became of the last. Then what is
under way is brought to its end, which is what an actor does that is told to stop after its update.
"""

import json
import os
import random
import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final, NamedTuple

import click
import numpy as np
import zenoh

from hoz_dist.cli.child import die_with_parent
from hoz_dist.wire.protocol.answers import Accepted, Busy, PushReply, Refused
from hoz_dist.wire.protocol.codec import checksum, decode, encode
from hoz_dist.wire.protocol.keys import Keys
from hoz_dist.wire.protocol.parameters import ParametersHead
from hoz_dist.wire.protocol.pushes import GradientPush
from hoz_dist.wire.transport.ask import ask
from hoz_dist.wire.transport.session import open_client

FRAMES: Final = 20
ATTEMPT_S: Final = 20.0
FIRST_PAUSE_S: Final = 0.05
LONGEST_PAUSE_S: Final = 2.0
CONNECT_S: Final = 60.0


class Outcome(NamedTuple):
    """What became of one gradient."""

    actor: str
    incarnation: int
    sequence: int
    result: str
    """`accepted`, or the reason of the refusal."""
    time: float
    """When the answer came, seconds since 1970."""
    tries: int
    busy: int
    """How often the learner said that it was busy."""
    unanswered: int
    """How often nobody answered."""


def read_outcomes(path: Path) -> list[Outcome]:
    """Read what a process of pushers wrote down."""
    return [Outcome(**json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]


class _Newest:
    """The newest parameters that any pusher of this process heard of."""

    def __init__(self, head: ParametersHead) -> None:
        self.size = head.size
        self._stamp, self._lock = head.stamp, threading.Lock()

    @property
    def stamp(self) -> tuple[int, int]:
        with self._lock:
            return self._stamp

    def heard(self, epoch: int, version: int) -> None:
        with self._lock:
            self._stamp = max(self._stamp, (epoch, version))


def _head(session: zenoh.Session, keys: Keys, stop: threading.Event) -> ParametersHead:
    while True:
        for answer in ask(session, keys.params, timeout_s=ATTEMPT_S, stop=stop):
            return decode(answer.payload, ParametersHead)
        stop.wait(FIRST_PAUSE_S)


def _try(session: zenoh.Session, key: str, payload: bytes) -> PushReply | None:
    """Push once; None when nobody answers."""
    for reply in session.get(key, timeout=ATTEMPT_S, payload=payload, attachment=checksum(payload)):
        sample = reply.ok or reply.err
        data = sample.payload.to_bytes() if sample is not None else b"Timeout"
        if data != b"Timeout":
            return decode(data, Accepted, Busy, Refused)  # type: ignore[return-value]  # one of these
    return None


def _push(session: zenoh.Session, keys: Keys, push: GradientPush, newest: _Newest) -> Outcome:
    """Push until it is known what became of it."""
    payload, seen, pause_s, clock = encode(push), Counter[str](), FIRST_PAUSE_S, threading.Event()
    while True:
        reply = _try(session, keys.grads(push.actor), payload)
        match reply:
            case Accepted(epoch, version):
                newest.heard(epoch, version)
                result = "accepted"
                break
            case Refused(reason):
                result = str(reason)
                break
        seen["busy" if reply is not None else "unanswered"] += 1
        clock.wait(random.uniform(pause_s / 2, pause_s))
        pause_s = min(2 * pause_s, LONGEST_PAUSE_S)
    return Outcome(
        *(push.actor, push.incarnation, push.sequence, result, time.time()),
        tries=1 + seen.total(),
        busy=seen["busy"],
        unanswered=seen["unanswered"],
    )


def _push_all(
    session: zenoh.Session, keys: Keys, actor: str, newest: _Newest, stop: threading.Event
) -> Iterator[Outcome]:
    incarnation = random.SystemRandom().getrandbits(48)
    values = np.random.default_rng(incarnation).normal(size=newest.size).astype(np.float32)
    values /= 2 * np.linalg.norm(values)
    sequence = 0
    while not stop.is_set():
        push = GradientPush(actor, incarnation, sequence, *newest.stamp, FRAMES, values)
        yield _push(session, keys, push, newest)
        sequence += 1


@click.command()
@click.option("--connect", required=True)
@click.option("--run", required=True)
@click.option("--out", type=click.Path(path_type=Path), required=True)
@click.option("--prefix", default="p", help="Of the actors' names.")
@click.option("--actors", type=int, required=True)
def main(connect: str, run: str, out: Path, prefix: str, actors: int) -> None:
    """Push until SIGTERM."""
    die_with_parent(os.getppid())
    stop, keys, lock = threading.Event(), Keys(run), threading.Lock()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())

    def work(actor: str) -> None:
        for outcome in _push_all(session, keys, actor, newest, stop):
            line: dict[str, Any] = outcome._asdict()
            with lock:
                file.write(json.dumps(line) + "\n")
                file.flush()

    with (
        open_client(connect, CONNECT_S, stop) as session,
        out.open("w", encoding="utf-8") as file,
        ThreadPoolExecutor(actors) as threads,
    ):
        newest = _Newest(_head(session, keys, stop))
        list(threads.map(work, (f"{prefix}{number}" for number in range(actors))))


if __name__ == "__main__":
    main()
