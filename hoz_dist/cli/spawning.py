"""Starts processes of `multiprocessing` that Ctrl-C does not reach."""

import signal
from collections.abc import Iterable
from multiprocessing.process import BaseProcess


def start_shielded(processes: Iterable[BaseProcess]) -> None:
    """Start processes that SIGINT cannot hit, not even in the midst of their imports.

    Ctrl-C reaches every process of the terminal; the one that starts these acts on it, and ends them. They begin with
    its signal mask, which keeps SIGINT out meanwhile, and stays theirs.

    Args:
        processes: Not started yet.
    """
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        for process in processes:
            process.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
