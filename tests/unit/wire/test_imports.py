"""A robot's client starts without the learning libraries and the simulator."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("modules", "forbidden"),
    [
        ("hoz_dist.client, hoz_dist.cli.query, hoz_dist.cli.status", "torch pybullet gymnasium sklearn scipy rich"),
        ("hoz_dist.cli.query, hoz_dist.cli.status", "zenoh numpy msgpack"),
        (
            "hoz_dist.wire.transport.environment, hoz_dist.wire.transport.endpoint, hoz_dist.wire.protocol.keys",
            "zenoh numpy msgpack",
        ),
    ],
)
def test_modules_start_without(modules: str, forbidden: str) -> None:
    code = f"import sys, {modules}; print(*(set({forbidden.split()!r}) & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert loaded.split() == []
