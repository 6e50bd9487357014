"""The router files that are deployed, opened by real Zenoh routers."""

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
import zenoh

from hoz_dist.cli.main import run
from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.security.authority import Authority
from hoz_dist.wire.transport.credentials import CERTIFICATE_FILE, KEY_FILE, ROUTER_FILE, load_credentials
from hoz_dist.wire.transport.session import is_connected, open_client, open_configured_router
from hoz_dist.wire.transport.settings import router_settings

DEPLOYED = Path(__file__).parents[2] / "deploy" / "router" / "router.json5"

pytestmark = pytest.mark.integration


def taken(path: Path) -> dict[str, Any]:
    """Return what Zenoh has read of the settings that every router of ours has."""
    config = zenoh.Config.from_file(path)
    return {name: json.loads(config.get_json(name)) for name in router_settings()}


@pytest.fixture
def authority(tmp_path: Path) -> Path:
    keys = tmp_path / "keys"
    assert run(["keys", "init", str(keys)]) == 0
    return keys


def issue(authority: Path, role: str, name: str, *options: str) -> Path:
    assert run(["keys", "issue", role, name, "--authority", str(authority), *options]) == 0
    return authority / f"{role}-{name}"


def test_file_for_trusted_networks_opens_and_lets_clients_in(tmp_path: Path, free_port: int) -> None:
    file = tmp_path / "router.json5"
    text = DEPLOYED.read_text()
    assert "tcp/0.0.0.0:7447" in text
    file.write_text(text.replace("tcp/0.0.0.0:7447", f"tcp/127.0.0.1:{free_port}"))
    with open_configured_router(file), open_client(f"tcp/127.0.0.1:{free_port}") as client:
        assert is_connected(client)


def test_file_for_trusted_networks_has_the_settings_of_every_router() -> None:
    assert taken(DEPLOYED) == router_settings()


def test_zenohd_tells_nobody_about_itself() -> None:
    # It turns its administration on, whatever a file says; only these keep it silent.
    permissions = json.loads(zenoh.Config.from_file(DEPLOYED).get_json("adminspace/permissions"))
    assert permissions == {"read": False, "write": False}


def test_generated_file_opens_and_lets_keys_in(authority: Path, free_port: int) -> None:
    endpoint = f"tls/127.0.0.1:{free_port}"
    router = issue(authority, "router", "main", "--listen", endpoint)
    viewer = load_credentials(issue(authority, "viewer", "v"))
    with open_configured_router(router / ROUTER_FILE), open_client(endpoint, credentials=viewer) as client:
        assert is_connected(client)


def test_generated_file_has_the_settings_of_every_router(authority: Path) -> None:
    file = issue(authority, "router", "main", "--at", "/etc/hoz-dist/keys/router-main") / ROUTER_FILE
    assert taken(file) == router_settings()
    config = zenoh.Config.from_file(file)
    assert json.loads(config.get_json("access_control/default_permission")) == "deny"
    assert json.loads(config.get_json("transport/link/tls/enable_mtls")) is True


def test_a_key_that_others_can_read_is_refused(authority: Path, free_port: int) -> None:
    router = issue(authority, "router", "main", "--listen", f"tls/127.0.0.1:{free_port}")
    (router / KEY_FILE).chmod(0o644)
    with pytest.raises(InvalidValueError, match=f"Others can read the private key '{router / KEY_FILE}'"):
        open_configured_router(router / ROUTER_FILE)


def test_a_key_that_has_expired_is_refused(authority: Path, free_port: int) -> None:
    router = issue(authority, "router", "main", "--listen", f"tls/127.0.0.1:{free_port}")
    last_year = datetime.now(UTC) - timedelta(days=365)
    pair = Authority.create().issue("router-main", ("127.0.0.1",), timedelta(days=1), last_year)
    (router / CERTIFICATE_FILE).write_bytes(pair.certificate_pem)
    with pytest.raises(InvalidValueError, match=f"The key in '{router}' expired on"):
        open_configured_router(router / ROUTER_FILE)


@pytest.mark.parametrize("name", [CERTIFICATE_FILE, KEY_FILE])
def test_a_file_of_the_key_that_is_missing_is_named(authority: Path, free_port: int, name: str) -> None:
    router = issue(authority, "router", "main", "--listen", f"tls/127.0.0.1:{free_port}")
    (router / name).unlink()
    with pytest.raises(NotFoundError, match=f"There is no '{router / name}'"):
        open_configured_router(router / ROUTER_FILE)
