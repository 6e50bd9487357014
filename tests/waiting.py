"""Waiting until something is as wanted, with a deadline instead of a sleep."""

import threading
import time
from collections.abc import Callable

LOOK_EVERY_S = 0.02


def comes_true(wanted: Callable[[], bool], within_s: float) -> bool:
    """Wait until something is as wanted; False when it is not in time."""
    end, pause = time.monotonic() + within_s, threading.Event()
    while not wanted():
        if time.monotonic() > end:
            return False
        pause.wait(LOOK_EVERY_S)
    return True


def until(wanted: Callable[[], bool], what: str, within_s: float = 90.0) -> None:
    """Wait until something is as wanted.

    Raises:
        TimeoutError: It is not in time.
    """
    if not comes_true(wanted, within_s):
        message = f"waited {within_s:g} s in vain for {what}"
        raise TimeoutError(message)
