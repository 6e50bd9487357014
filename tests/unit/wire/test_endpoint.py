import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.wire.transport.endpoint import DEFAULT_ENDPOINT, check_endpoint


@pytest.mark.parametrize(
    "endpoint", [DEFAULT_ENDPOINT, "tcp/learner.hoz.svc:1", "tls/host-1:65535", "tcp/[::1]:7447", "quic/0.0.0.0:80"]
)
def test_endpoints_are_protocol_host_and_port(endpoint: str) -> None:
    assert check_endpoint(endpoint) == endpoint


@pytest.mark.parametrize(
    "endpoint",
    [
        "",
        "tcp",
        "127.0.0.1:7447",
        "tcp/127.0.0.1",
        "tcp/:7447",
        "tcp/h:0",
        "tcp/h:65536",
        "http/h:80",
        "tcp/h:1#iface=x",
    ],
)
def test_anything_else_is_refused_with_an_example(endpoint: str) -> None:
    with pytest.raises(InvalidValueError, match="is not an endpoint: write protocol/host:port, for example tcp/127"):
        check_endpoint(endpoint)
