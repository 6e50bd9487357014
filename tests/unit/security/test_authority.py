from datetime import UTC, datetime, timedelta
from ipaddress import IPv4Address

import pytest
from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.x509.oid import ExtendedKeyUsageOID

from hoz_dist.errors import DamagedFileError, InvalidValueError
from hoz_dist.security.authority import AUTHORITY_DAYS, Authority

DAY = timedelta(days=1)


@pytest.fixture(scope="module")
def authority() -> Authority:
    return Authority.create()


def purposes(certificate: x509.Certificate) -> list[x509.ObjectIdentifier]:
    return list(certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value)


def test_what_it_issues_is_signed_by_it_and_by_no_other(authority: Authority) -> None:
    issued = authority.issue("actor-a0", (), DAY).certificate
    issued.verify_directly_issued_by(authority.pair.certificate)
    other = Authority.create()
    impostor = Authority(other.pair._replace(certificate=authority.pair.certificate)).issue("actor-a0", (), DAY)
    with pytest.raises(InvalidSignature):
        impostor.certificate.verify_directly_issued_by(authority.pair.certificate)


def test_a_client_key_cannot_serve_as_a_routers(authority: Authority) -> None:
    client, router = authority.issue("actor-a0", (), DAY), authority.issue("router-r0", ("localhost",), DAY)
    assert purposes(client.certificate) == [ExtendedKeyUsageOID.CLIENT_AUTH]
    assert purposes(router.certificate) == [ExtendedKeyUsageOID.SERVER_AUTH]
    for issued in (client, router):
        constraints = issued.certificate.extensions.get_extension_for_class(x509.BasicConstraints)
        assert constraints.critical
        assert not constraints.value.ca


def test_a_routers_certificate_names_its_hosts(authority: Authority) -> None:
    issued = authority.issue("router-r0", ("router.lab.example", "10.0.0.7", "::1"), DAY).certificate
    names = issued.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["router.lab.example"]
    assert names.get_values_for_type(x509.IPAddress)[0] == IPv4Address("10.0.0.7")


@pytest.mark.parametrize("host", ["", "tls/h:7447", "h:7447", "ü.example", "a b", "-h", "h.", "a" * 64])
def test_what_is_no_host_is_refused(authority: Authority, host: str) -> None:
    with pytest.raises(InvalidValueError, match="neither the name nor the address of a machine"):
        authority.issue("router-r0", (host,), DAY)


def test_keys_are_valid_a_little_earlier_for_clocks_that_differ(authority: Authority) -> None:
    now = datetime.now(UTC).replace(microsecond=0)
    issued = authority.issue("actor-a0", (), 30 * DAY, now).certificate
    assert issued.not_valid_before_utc == now - timedelta(hours=1)
    assert issued.not_valid_after_utc == now + 30 * DAY


def test_no_key_outlives_the_authority() -> None:
    now = datetime.now(UTC).replace(microsecond=0)
    old = Authority.create(now - timedelta(days=AUTHORITY_DAYS - 1))
    assert old.issue("actor-a0", (), 30 * DAY, now).certificate.not_valid_after_utc == now + DAY
    with pytest.raises(InvalidValueError, match="The authority has expired; make a new one"):
        old.issue("actor-a0", (), DAY, now + DAY)


def test_an_authority_is_read_back(authority: Authority) -> None:
    again = Authority.load(authority.pair.certificate_pem, authority.pair.private_key_pem)
    again.issue("actor-a0", (), DAY).certificate.verify_directly_issued_by(authority.pair.certificate)


def test_damaged_files_are_said_without_quoting_them(authority: Authority) -> None:
    pair = authority.pair
    for files in [
        (b"", pair.private_key_pem),
        (pair.certificate_pem, pair.private_key_pem[:-40]),
        (pair.certificate_pem, b"secret"),
        (pair.certificate_pem, Authority.create().pair.private_key_pem),
    ]:
        with pytest.raises(DamagedFileError, match="restore them from a copy") as caught:
            Authority.load(*files)
        assert "secret" not in str(caught.value)
        assert caught.value.__cause__ is None


def test_printing_shows_no_key(authority: Authority) -> None:
    secret = authority.pair.private_key.private_numbers().private_value
    for shown in (repr(authority), repr(authority.pair), str(authority.pair)):
        assert str(secret) not in shown
        assert "PRIVATE KEY" not in shown
