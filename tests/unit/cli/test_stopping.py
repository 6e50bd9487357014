"""Signals as an event, in processes of their own."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

WITHIN_S = 60.0
SIGNALS = 5000
APART_S = 0.0003
"""Signals that come faster are one to Python."""

FLOOD = """
import sys, threading
from hoz_dist.cli.stopping import stop_on_signals

stop = stop_on_signals()
print("ready", flush=True)
reader = threading.Thread(target=sys.stdin.readline)
reader.start()
while reader.is_alive():
    stop.wait(0.0001)
    stop.clear()
print("survived", flush=True)
"""

WAIT = """
import sys
import time
from hoz_dist.cli.stopping import stop_on_signals

stop = stop_on_signals()
print("ready", flush=True)
stop.wait()
sys.stdin.readline()
print("stopped", flush=True)
"""


@contextmanager
def started(program: str) -> Iterator["subprocess.Popen[str]"]:
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


def test_no_signal_catches_the_main_thread_with_the_events_lock() -> None:
    with started(FLOOD) as process:
        for _ in range(SIGNALS):
            process.send_signal(signal.SIGTERM)
            time.sleep(APART_S)
        output, _ = process.communicate("end\n", timeout=WITHIN_S)
    assert (process.returncode, output) == (0, "survived\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_wait_without_end_and_more_do_not_hurt(number: signal.Signals) -> None:
    with started(WAIT) as process:
        for _ in range(3):
            process.send_signal(number)
        output, _ = process.communicate("end\n", timeout=WITHIN_S)
    assert (process.returncode, output) == (0, "stopped\n")
