"""Opening Zenoh sessions: routers, of which a learner's session may be one, and their clients.

With credentials a session speaks TLS, proves who it is, and makes the other side prove that the same authority knows
it.
"""

import json
import re
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import zenoh
from zenoh import Session

from hoz_dist.errors import ConnectionFailedError, DamagedFileError, InvalidValueError, NotFoundError
from hoz_dist.waiting import Deadline, StoppedError
from hoz_dist.wire.transport.endpoint import check_endpoint, is_encrypted
from hoz_dist.wire.transport.settings import (
    CLIENT_LEASE_MS,
    client_settings,
    router_settings,
    shared_memory_settings,
    tls_settings,
)

if TYPE_CHECKING:
    # Reading certificates takes a tenth of a second to import, which only who has some needs to wait for.
    from hoz_dist.wire.transport.credentials import Credentials

__all__ = ["Session", "is_connected", "open_client", "open_configured_router", "open_router"]

CONNECT_TIMEOUT_S: Final = 2.0
"""How long opening waits for a router by default; it tries again and again within this time."""
_ATTEMPT_S: Final = 2.0
"""How long Zenoh tries without a look at the stop event."""


def open_router(
    listen: str | Sequence[str], credentials: "Credentials | None" = None, *, shared_memory: bool = False
) -> Session:
    """Open a session that is a router: others connect to it. Use it in a ``with`` statement.

    What the session itself sends and receives does not pass the access control.

    Args:
        listen: Endpoint to listen at, or several.
        credentials: Keys of a router, with its access control; None for a router that lets everybody in.
        shared_memory: Whether messages may pass through shared memory; see `SharedMemory.on`.

    Raises:
        InvalidValueError: An endpoint is malformed, or is none for the credentials.
        NotFoundError: The key folder has no access control.
        DamagedFileError: The access control cannot be read.
        ConnectionFailedError: An endpoint is in use, does not belong to this machine, or cannot be listened at.
    """
    endpoints = [listen] if isinstance(listen, str) else list(listen)
    for endpoint in endpoints:
        _check_protection(check_endpoint(endpoint), credentials)
    settings = router_settings() | {"listen/endpoints": endpoints}
    if shared_memory:
        settings |= shared_memory_settings()
    if credentials is not None:
        access_control = _read_config(credentials.router_file).get_json("access_control")
        settings |= _keys(credentials) | {"access_control": json.loads(access_control)}
    return _listen(_configured(zenoh.Config(), settings), ", ".join(endpoints), "choose another endpoint with --listen")


def open_configured_router(path: Path) -> Session:
    """Open a router from a file, as `zenohd --config FILE` does. Use it in a ``with`` statement.

    Args:
        path: A configuration of Zenoh, JSON5.

    Raises:
        NotFoundError: The file, or one of the router's key that it names, does not exist.
        DamagedFileError: It is no configuration of Zenoh, or the router's certificate cannot be read.
        InvalidValueError: It is not that of a router, others can read the router's private key, or the certificate is
            not valid now.
        ConnectionFailedError: An endpoint is in use, does not belong to this machine, or cannot be listened at.
    """
    config = _read_config(path)
    if json.loads(config.get_json("mode")) != "router":
        message = f"'{path}' does not configure a router; it must say: mode: \"router\"."
        raise InvalidValueError(message)
    _check_own_key(config)
    return _listen(config, f"the endpoints in '{path}'", "mend the file")


def open_client(
    connect: str,
    timeout_s: float = CONNECT_TIMEOUT_S,
    stop: threading.Event | None = None,
    credentials: "Credentials | None" = None,
    lease_ms: int = CLIENT_LEASE_MS,
    *,
    shared_memory: bool = False,
) -> Session:
    """Open a session as a client of a router. Use it in a ``with`` statement.

    Once open it survives the router: it reconnects by itself.

    Args:
        connect: Endpoint of the router or of a learner.
        timeout_s: How long to wait for the router, seconds; it is tried again and again meanwhile.
        stop: Ends the wait early.
        credentials: Keys of this process; None where no router asks for them.
        lease_ms: Silence after which the router gives this process up, milliseconds.
        shared_memory: Whether messages may pass through shared memory; see `SharedMemory.on`.

    Raises:
        InvalidValueError: The endpoint is malformed, or is none for the credentials.
        ConnectionFailedError: No router answers in time, or the router and we do not accept each other's keys.
        StoppedError: The stop event was set.
    """
    endpoint, deadline = check_endpoint(connect), Deadline(timeout_s)
    _check_protection(endpoint, credentials)
    settings = client_settings(lease_ms) | {"connect/endpoints": [endpoint]}
    if shared_memory:
        settings |= shared_memory_settings()
    if credentials is not None:
        settings |= _keys(credentials)
    while True:
        # Zenoh cannot be told to stop meanwhile, and is not interrupted by signals.
        attempt_ms = max(round(deadline.within(_ATTEMPT_S) * 1000), 1)
        try:
            return zenoh.open(_configured(zenoh.Config(), settings | {"connect/timeout_ms": attempt_ms}))
        except zenoh.ZError as error:
            if stop is not None and stop.is_set():
                raise StoppedError from error
            if deadline.passed:
                raise ConnectionFailedError(_nobody_answers(connect, credentials)) from error


def is_connected(session: Session) -> bool:
    """Tell whether a client's session has a router at the moment.

    A killed router is noticed at once, one that stands still after its lease; later while megabytes are on the way to
    it.
    """
    return bool(session.info.routers_zid())


def _keys(credentials: "Credentials") -> dict[str, Any]:
    return tls_settings(credentials.authority, credentials.certificate, credentials.key)


def _check_own_key(config: zenoh.Config) -> None:
    """Check the key that a router shows, if its configuration names the files of one.

    Raises:
        HozError: See `open_configured_router`.
    """
    names = ("listen_certificate", "listen_private_key")
    certificate, key = (json.loads(config.get_json(f"transport/link/tls/{name}")) for name in names)
    if certificate and key:
        from hoz_dist.wire.transport.credentials import check_key  # noqa: PLC0415 - slow to import

        check_key(Path(certificate), Path(key))


def _check_protection(endpoint: str, credentials: "Credentials | None") -> None:
    """Check that an endpoint that encrypts has keys, and that keys are not given where they would protect nothing.

    Raises:
        InvalidValueError: It is not so.
    """
    if is_encrypted(endpoint) == (credentials is not None):
        return
    if credentials is None:
        message = f"'{endpoint}' is encrypted and needs keys: add --keys FOLDER."
    else:
        message = (
            f"'{endpoint}' is not encrypted, so that keys protect nothing there: use tls/{endpoint.partition('/')[2]}."
        )
    raise InvalidValueError(message)


def _nobody_answers(connect: str, credentials: "Credentials | None") -> str:
    """Say what may be wrong when no session could be opened; Zenoh does not tell."""
    if credentials is None:
        return (
            f"No learner or router answers at {connect}; "
            "start one with `hoz-dist learner --listen ...` or check the address."
        )
    return (
        f"No router at {connect} lets us in; check the address, that the router runs, that its certificate names this "
        f"host, and that the key in '{credentials.folder}' is of the same authority."
    )


def _listen(config: zenoh.Config, where: str, advice: str) -> Session:
    """Open a router.

    Args:
        config: Its configuration.
        where: What it listens at, for the error.
        advice: What to do when it cannot, for the error.

    Raises:
        ConnectionFailedError: It cannot listen.
    """
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        message = f"Cannot listen at {where}: {_reason(error)}; {advice}."
        raise ConnectionFailedError(message) from error


def _reason(error: zenoh.ZError) -> str:
    """Say why an endpoint cannot be listened at."""
    text = str(error)
    if "in use" in text:
        return "it is in use"
    if "Cannot assign requested address" in text:
        return "the address does not belong to this machine"
    return _words(error)


def _words(error: zenoh.ZError) -> str:
    """Return Zenoh's own words, less the places in its source code; the innermost cause stands in brackets."""
    words = re.sub(r" at \S+\.rs:\d+\.?", "", str(error))
    cause = re.search(r": \[(.*)\]$", words)
    return " ".join((cause[1] if cause else words).split()).rstrip(". ")


def _read_config(path: Path) -> zenoh.Config:
    """Read a configuration file.

    Raises:
        NotFoundError: There is none.
        DamagedFileError: It is no configuration of Zenoh.
    """
    if not path.is_file():
        message = f"There is no router configuration '{path}'; `hoz-dist keys issue router NAME` makes one."
        raise NotFoundError(message)
    try:
        return zenoh.Config.from_file(path)
    except zenoh.ZError as error:
        message = f"'{path}' is no configuration of Zenoh ({_words(error)})."
        raise DamagedFileError(message) from error


def _configured(config: zenoh.Config, settings: Mapping[str, Any]) -> zenoh.Config:
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    return config
