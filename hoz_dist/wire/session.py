"""Opening Zenoh sessions: the learner's, which is the router, and those of actors and queries, which are its clients.

The settings follow what was measured: no multicast (container networks have none), client mode (it reconnects and
declares everything again by itself), retries from 200 ms to 2 s (the default takes 3.4 s to come back).
"""

import json
import re
import threading
from typing import Any, Final

import zenoh
from zenoh import Session

from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.endpoint import check_endpoint
from hoz_dist.wire.waiting import Deadline, StoppedError

__all__ = ["Session", "open_client", "open_router"]

CONNECT_TIMEOUT_S: Final = 2.0
"""How long opening waits for a router by default; it tries again and again within this time."""
_ATTEMPT_S: Final = 2.0
"""How long Zenoh tries without a look at the stop event."""
_COMMON: Final[dict[str, Any]] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "scouting/delay": 0,  # nothing is scouted for; a router would wait half a second for it all the same
    # Plain bytes: implicit shared memory leaks segments of killed processes, and serves messages up to 16 MB only.
    "transport/shared_memory/enabled": False,
    # A receiver that stalls longer than this loses the transport, and with it what was in flight (5 s by default).
    "transport/link/tx/queue/congestion_control/block/wait_before_close": 10_000_000,
    "transport/link/rx/buffer_size": 4 * 1024 * 1024,
    "transport/link/rx/max_message_size": 128 * 1024 * 1024,
}
_RETRY: Final = {"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 2}


def open_router(listen: str) -> Session:
    """Open a session that is a router: others connect to it. Use it in a ``with`` statement.

    Args:
        listen: Endpoint to listen at.

    Raises:
        InvalidValueError: The endpoint is malformed.
        ConnectionFailedError: The endpoint is in use, does not belong to this machine, or cannot be listened at.
    """
    settings = {
        "mode": "router",
        "listen/endpoints": [check_endpoint(listen)],
        "listen/exit_on_failure": True,
        "listen/timeout_ms": 0,
    }
    try:
        return zenoh.open(_config(settings))
    except zenoh.ZError as error:
        message = f"Cannot listen at {listen}: {_reason(error)}; choose another endpoint with --listen."
        raise ConnectionFailedError(message) from error


def open_client(connect: str, timeout_s: float = CONNECT_TIMEOUT_S, stop: threading.Event | None = None) -> Session:
    """Open a session as a client of a router. Use it in a ``with`` statement.

    Once open it survives the router: it reconnects by itself.

    Args:
        connect: Endpoint of the router or of a learner.
        timeout_s: How long to wait for the router, seconds; it is tried again and again meanwhile.
        stop: Ends the wait early.

    Raises:
        InvalidValueError: The endpoint is malformed.
        ConnectionFailedError: No router answers in time.
        StoppedError: The stop event was set.
    """
    endpoint, deadline = check_endpoint(connect), Deadline(timeout_s)
    while True:
        attempt_ms = max(round(deadline.within(_ATTEMPT_S) * 1000), 1)
        try:
            return _open_client(endpoint, attempt_ms)
        except zenoh.ZError as error:
            if stop is not None and stop.is_set():
                raise StoppedError from error
            if deadline.passed:
                message = (
                    f"No learner or router answers at {connect}; "
                    "start one with `hoz-dist learner --listen ...` or check the address."
                )
                raise ConnectionFailedError(message) from error


def _open_client(endpoint: str, timeout_ms: int) -> Session:
    """Open a client's session; Zenoh cannot be told to stop meanwhile, and is not interrupted by signals."""
    settings = {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": timeout_ms,
        "connect/retry": _RETRY,
    }
    return zenoh.open(_config(settings))


def _reason(error: zenoh.ZError) -> str:
    """Say why an endpoint cannot be listened at."""
    text = str(error)
    if "in use" in text:
        return "it is in use"
    if "Cannot assign requested address" in text:
        return "the address does not belong to this machine"
    # Zenoh's own words, less the places in its source code; the innermost cause stands in brackets.
    words = re.sub(r" at \S+\.rs:\d+\.?", "", text)
    cause = re.search(r": \[(.*)\]$", words)
    return (cause[1] if cause else words).rstrip(". ")


def _config(settings: dict[str, Any]) -> zenoh.Config:
    config = zenoh.Config()
    for path, value in (_COMMON | settings).items():
        config.insert_json5(path, json.dumps(value))
    return config
