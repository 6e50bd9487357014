"""Fixtures that all tests share."""

import os
import socket
from pathlib import Path

import pytest


@pytest.fixture(scope="session", autouse=True)
def _one_torch_thread() -> None:
    """Keep torch to one thread: results then do not depend on the number of cores, and processes do not compete."""
    os.environ["OMP_NUM_THREADS"] = "1"  # for the processes that tests start
    import torch

    torch.set_num_threads(1)


@pytest.fixture
def free_port() -> int:
    """A TCP port of the loopback address that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The view cache of this test run; HOZ_TEST_CACHE names a folder to keep it in between runs."""
    kept = os.environ.get("HOZ_TEST_CACHE")
    folder = Path(kept) if kept else tmp_path_factory.mktemp("views")
    folder.mkdir(parents=True, exist_ok=True)
    return folder
