"""Free places on the loopback address for processes that this one starts."""

import socket


def free_endpoint() -> str:
    """Return an endpoint of the loopback address that nothing listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return f"tcp/127.0.0.1:{port}"
