"""Endpoints: where Zenoh sessions listen and connect."""

import re
from typing import Final

from hoz_dist.errors import InvalidValueError

DEFAULT_ENDPOINT: Final = "tcp/127.0.0.1:7447"
DEFAULT_ENCRYPTED_ENDPOINT: Final = "tls/0.0.0.0:7447"
"""Where a router with keys listens: it need not fear other machines."""
_PROTOCOLS: Final = ("tcp", "tls", "quic", "udp", "ws")
_ENCRYPTED: Final = ("tls", "quic")
_PATTERN: Final = re.compile(rf"({'|'.join(_PROTOCOLS)})/(\[[0-9A-Fa-f:.]+\]|[^\s:/?#\[\]]+):(?P<port>\d{{1,5}})")
_LAST_PORT: Final = 65535


def check_endpoint(endpoint: str) -> str:
    """Return the endpoint when it is well formed.

    Args:
        endpoint: ``protocol/host:port``, for example ``tcp/127.0.0.1:7447``.

    Raises:
        InvalidValueError: It is not.
    """
    match = _PATTERN.fullmatch(endpoint)
    if match is None or not 1 <= int(match["port"]) <= _LAST_PORT:
        message = (
            f"'{endpoint}' is not an endpoint: write protocol/host:port, for example {DEFAULT_ENDPOINT} "
            f"(protocols: {', '.join(_PROTOCOLS)})."
        )
        raise InvalidValueError(message)
    return endpoint


def is_encrypted(endpoint: str) -> bool:
    """Tell whether a well formed endpoint is one where both sides show keys."""
    return endpoint.partition("/")[0] in _ENCRYPTED
