"""Zenoh's own questions and answers, with nothing of ours around them: the limit of pushes and queries."""

import threading
from collections.abc import Callable
from typing import Final

from hoz_dist.closing import Closing
from hoz_dist.wire.transport.session import Session, open_router

BARE_KEY: Final = "hoz-bench/bare"
TICK_S: Final = 0.1
"""How long a process that serves waits at once for the word to stop, seconds."""


class BareReplies(Closing):
    """Answers every question on a key.

    Args:
        session: Session to answer on.
        answer: Makes the answer.
        key: The key.
    """

    def __init__(self, session: Session, answer: Callable[[], bytes], key: str = BARE_KEY) -> None:
        self._queryable = session.declare_queryable(key)
        self._answer = answer
        self._key = key
        self._thread = threading.Thread(target=self._run, name="bare replies", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop answering."""
        self._queryable.undeclare()  # type: ignore[no-untyped-call]
        self._thread.join()

    def _run(self) -> None:
        for query in self._queryable.handler:
            with query:
                if query.payload is not None:
                    query.payload.to_bytes()
                query.reply(self._key, self._answer())


def ask_bare(session: Session, payload: bytes | None = None, key: str = BARE_KEY) -> bytes:
    """Ask once, and return the answer; nothing if there is none."""
    replies = session.get(key, payload=payload)
    return b"".join(reply.ok.payload.to_bytes() for reply in replies if reply.ok is not None)


def answer_bare(endpoint: str, payload: bytes, *, ready: Callable[[], None], stopped: Callable[[float], bool]) -> None:
    """Answer bare questions until told to stop.

    Args:
        endpoint: Where to listen.
        payload: The answer.
        ready: Called when it listens.
        stopped: Tells whether to stop; waits for that so many seconds.
    """
    with open_router(endpoint) as session, BareReplies(session, lambda: payload):
        ready()
        while not stopped(TICK_S):
            pass
