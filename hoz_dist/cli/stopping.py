"""Turns SIGINT and SIGTERM into an event, for commands that stop when they have finished what they are about."""

import os
import signal
import threading
from typing import Final

SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)


def stop_on_signals() -> threading.Event:
    """Return an event that SIGINT and SIGTERM set; call it once, in the main thread.

    A handler must not set it: it runs in the main thread, which may hold the event's lock in `wait`, and would wait for
    itself for ever. Python therefore writes the number of a signal to a pipe, and a thread reads it. Children that
    start by exec or spawn know nothing of this; a bare fork would share the pipe.
    """
    stop = threading.Event()
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    # A full pipe is no harm: what is in it sets the event too.
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    threading.Thread(target=_set_when_told, args=(stop, reading), name="signals", daemon=True).start()
    for number in SIGNALS:
        signal.signal(number, lambda *_: None)
    return stop


def _set_when_told(stop: threading.Event, reading: int) -> None:
    while told := os.read(reading, 4096):
        if any(number in told for number in SIGNALS):
            stop.set()
