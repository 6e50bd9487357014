"""Those who have no key, or the wrong one: they do not get as far as the access control."""

import json
import shutil
import socket
import ssl
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import zenoh

from hoz_dist.errors import ConnectionFailedError, InvalidValueError
from hoz_dist.security.authority import Authority, KeyPair
from hoz_dist.security.key_folders import AUTHORITY_KEY_FILE
from hoz_dist.wire.protocol.pushes import GradientPush
from hoz_dist.wire.transport.credentials import (
    AUTHORITY_FILE,
    CERTIFICATE_FILE,
    KEY_FILE,
    ROUTER_FILE,
    Credentials,
    common_name,
    load_credentials,
)
from hoz_dist.wire.transport.session import is_connected, open_client, open_router
from hoz_dist.wire.transport.settings import CLIENT_LEASE_MS, client_settings
from tests import wire_samples as samples
from tests.integration.security.network import DAY, KEYS, ROUTERS, Network, free_endpoint
from tests.integration.wire.pushing import until

pytestmark = pytest.mark.integration

NOT_LET_IN = "lets us in"


@pytest.fixture(autouse=True)
def _others_are_not_disturbed(network: Network) -> Iterator[None]:
    """After each test the same actor, which was there all the time, goes on."""
    with network.open("actor-a0") as actor:
        yield
        before = len(network.came)
        assert len(network.push(actor, KEYS.grads("a0"), samples.gradient_push())) == 1
        assert [type(push) for push in network.came[before:]] == [GradientPush]


def authority_of(network: Network) -> Authority:
    files = (AUTHORITY_FILE, AUTHORITY_KEY_FILE)
    return Authority.load(*((network.folder / name).read_bytes() for name in files))


def credentials_of(folder: Path, role: str, name: str, pair: KeyPair, trusted: Authority) -> Credentials:
    """Write a key folder by hand, as `hoz-dist keys` never would."""
    folder.mkdir(mode=0o700, exist_ok=True)
    (folder / AUTHORITY_FILE).write_bytes(trusted.pair.certificate_pem)
    (folder / CERTIFICATE_FILE).write_bytes(pair.certificate_pem)
    (folder / KEY_FILE).write_bytes(pair.private_key_pem)
    (folder / KEY_FILE).chmod(0o600)
    return Credentials(role, name, folder, pair.certificate.not_valid_after_utc)


def actor_signed_by(
    signer: Authority, folder: Path, trusted: Authority, lifetime: timedelta = DAY, now: datetime | None = None
) -> Credentials:
    pair = signer.issue(common_name("actor", "a1"), (), lifetime, now)
    return credentials_of(folder, "actor", "a1", pair, trusted)


def refused(network: Network, credentials: Credentials) -> bool:
    with pytest.raises(ConnectionFailedError, match=NOT_LET_IN):
        open_client(network.endpoint, timeout_s=1.0, credentials=credentials)
    return True


def test_a_key_of_the_same_authority_is_let_in(network: Network, tmp_path: Path) -> None:
    # The control of all tests below: the folder is made by the same hands, and only then spoilt.
    own = authority_of(network)
    with open_client(network.endpoint, credentials=actor_signed_by(own, tmp_path / "k", own)) as session:
        assert is_connected(session)
        assert network.ask(session, "config")


def test_a_key_of_another_authority_is_refused(network: Network, tmp_path: Path) -> None:
    # It trusts the router's authority, so that it is the router that refuses.
    stranger = actor_signed_by(Authority.create(), tmp_path / "k", authority_of(network))
    assert refused(network, stranger)


def test_a_key_of_an_authority_of_the_same_name_is_refused(network: Network, tmp_path: Path) -> None:
    own, impostor = authority_of(network), Authority.create()
    named_alike = Authority(KeyPair(own.pair.certificate, impostor.pair.private_key))
    assert refused(network, actor_signed_by(named_alike, tmp_path / "k", own))


def test_an_expired_key_is_refused(network: Network, tmp_path: Path) -> None:
    own = authority_of(network)
    expired = actor_signed_by(own, tmp_path / "k", own, now=datetime.now(UTC) - 2 * DAY)
    with pytest.raises(InvalidValueError, match=r"expired on .* UTC; issue it anew"):
        load_credentials(expired.folder)
    # Also by the router, if somebody leaves the check out.
    assert refused(network, expired)


def test_a_key_that_expires_ends_the_session(network: Network, tmp_path: Path) -> None:
    own = authority_of(network)
    short = actor_signed_by(own, tmp_path / "k", own, lifetime=timedelta(seconds=3))
    with open_client(network.endpoint, credentials=short) as session:
        assert network.ask(session, "config")
        assert until(lambda: not is_connected(session))
        assert network.ask(session, "config") == []


def test_a_client_without_a_certificate_is_refused(network: Network) -> None:
    keys = network.credentials("actor-a0")

    def opened(**connect: str) -> bool:
        settings = client_settings(CLIENT_LEASE_MS) | {
            "connect/endpoints": [network.endpoint],
            "connect/timeout_ms": 1000,
            "transport/link/tls": {"root_ca_certificate": str(keys.authority), "enable_mtls": bool(connect), **connect},
        }
        config = zenoh.Config()
        for path, value in settings.items():
            config.insert_json5(path, json.dumps(value))
        try:
            with zenoh.open(config):
                return True
        except zenoh.ZError:
            return False

    assert not opened()
    assert opened(connect_certificate=str(keys.certificate), connect_private_key=str(keys.key))


def test_plain_tcp_is_refused(network: Network) -> None:
    plain = network.endpoint.replace("tls/", "tcp/")
    with pytest.raises(ConnectionFailedError):
        open_client(plain, timeout_s=1.0)


def test_tls_without_zenoh_is_refused(network: Network) -> None:
    """A TLS client of another making, with no certificate: it is shut out before it can say anything."""
    keys = network.credentials("actor-a0")
    host, port = network.endpoint.removeprefix("tls/").split(":")

    def greeted(context: ssl.SSLContext) -> bool:
        try:
            with (
                socket.create_connection((host, int(port)), timeout=5.0) as raw,
                context.wrap_socket(raw, server_hostname=host) as wrapped,
            ):
                wrapped.settimeout(1.0)
                return wrapped.recv(1) != b""
        except TimeoutError:
            return True  # it waits for us to speak
        except ssl.SSLError:
            return False

    context = ssl.create_default_context(cafile=str(keys.authority))
    assert not greeted(context)
    context.load_cert_chain(keys.certificate, keys.key)
    assert greeted(context)


def test_an_actor_does_not_take_an_impostor_for_the_router(network: Network, tmp_path: Path) -> None:
    own = authority_of(network)
    here, elsewhere = ("127.0.0.1",), ("router.example",)

    def taken(pair: KeyPair) -> bool:
        folder = tmp_path / f"{pair.certificate.serial_number:x}"
        credentials = credentials_of(folder, "router", "r9", pair, own)
        shutil.copy(network.folder / f"router-{ROUTERS[0]}" / ROUTER_FILE, folder)
        endpoint = free_endpoint()
        with open_router(endpoint, credentials):
            try:
                with open_client(endpoint, timeout_s=1.0, credentials=network.credentials("actor-a0")):
                    return True
            except ConnectionFailedError:
                return False

    assert taken(own.issue("router-r9", here, DAY))
    assert not taken(own.issue("router-r9", elsewhere, DAY)), "a router of another host"
    assert not taken(own.issue("actor-a1", (), DAY)), "an actor's key"
    assert not taken(Authority.create().issue("router-r9", here, DAY)), "a router of another authority"
