"""The authority: signs the certificates by which routers and their clients know each other.

All keys are of the elliptic curve P-256, which every TLS library speaks. A certificate's common name, ``ROLE-NAME``, is
what the access control goes by; its purpose keeps an actor's key from serving as a router's.
"""

import ipaddress
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Final, NamedTuple, Self

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from hoz_dist.errors import DamagedFileError, InvalidValueError

AUTHORITY_DAYS: Final = 3650
CLOCK_SKEW: Final = timedelta(hours=1)
"""So much the clocks of the machines may differ: certificates are valid from a little earlier on."""
_HOST_NAME: Final = re.compile(
    r"(?=.{1,253}$)[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?(\.[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?)*"
)


class KeyPair(NamedTuple):
    """A certificate and its private key; printed without the key."""

    certificate: x509.Certificate
    private_key: ec.EllipticCurvePrivateKey

    @property
    def certificate_pem(self) -> bytes:
        """The certificate as a PEM file."""
        return self.certificate.public_bytes(serialization.Encoding.PEM)

    @property
    def private_key_pem(self) -> bytes:
        """The private key as a PEM file, not encrypted: processes must start without a person."""
        return self.private_key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )


@dataclass(frozen=True)
class Authority:
    """Who signs certificates.

    Attributes:
        pair: Its own certificate and key.
    """

    pair: KeyPair = field(repr=False)

    @classmethod
    def create(cls, now: datetime | None = None) -> Self:
        """Make a new authority.

        Args:
            now: When it begins; the present time by default.
        """
        private_key = ec.generate_private_key(ec.SECP256R1())
        name = x509.Name(
            [x509.NameAttribute(NameOID.COMMON_NAME, f"hoz-dist authority {x509.random_serial_number():x}")]
        )
        key_id = x509.SubjectKeyIdentifier.from_public_key(private_key.public_key())
        certificate = (
            _builder(name, name, private_key.public_key(), now or datetime.now(UTC), timedelta(days=AUTHORITY_DAYS))
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(_key_usage(signs_certificates=True), critical=True)
            .add_extension(key_id, critical=False)
            .sign(private_key, hashes.SHA256())
        )
        return cls(KeyPair(certificate, private_key))

    @classmethod
    def load(cls, certificate_pem: bytes, private_key_pem: bytes) -> Self:
        """Read an authority from its files.

        Raises:
            DamagedFileError: They are not a certificate and its key.
        """
        try:
            certificate = x509.load_pem_x509_certificate(certificate_pem)
            private_key = serialization.load_pem_private_key(private_key_pem, password=None)
        except (ValueError, TypeError):
            message = "The files of the authority are damaged; restore them from a copy."
            # Without the cause: nobody promises that it does not quote the file.
            raise DamagedFileError(message) from None
        if (
            not isinstance(private_key, ec.EllipticCurvePrivateKey)
            or private_key.public_key() != certificate.public_key()
        ):
            message = "The certificate of the authority and its key do not belong together; restore them from a copy."
            raise DamagedFileError(message)
        return cls(KeyPair(certificate, private_key))

    def issue(
        self, common_name: str, hosts: Sequence[str], lifetime: timedelta, now: datetime | None = None
    ) -> KeyPair:
        """Make a key and sign its certificate.

        Args:
            common_name: Who holds it.
            hosts: Names and addresses by which clients reach the holder; none for a client.
            lifetime: How long it is valid; it ends with the authority at the latest.
            now: When it begins; the present time by default.

        Raises:
            InvalidValueError: A host is neither a name nor an address, or the authority has expired.
        """
        private_key = ec.generate_private_key(ec.SECP256R1())
        now = now or datetime.now(UTC)
        left = self.pair.certificate.not_valid_after_utc - now
        if left <= timedelta():
            message = "The authority has expired; make a new one with `hoz-dist keys init`, and issue all keys anew."
            raise InvalidValueError(message)
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])
        purpose = ExtendedKeyUsageOID.SERVER_AUTH if hosts else ExtendedKeyUsageOID.CLIENT_AUTH
        issuer = self.pair.certificate
        builder = (
            _builder(subject, issuer.subject, private_key.public_key(), now, min(lifetime, left))
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_key_usage(signs_certificates=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage([purpose]), critical=False)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(private_key.public_key()), critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_public_key(self.pair.private_key.public_key()), critical=False
            )
        )
        if hosts:
            names = x509.SubjectAlternativeName([_general_name(host) for host in hosts])
            builder = builder.add_extension(names, critical=False)
        return KeyPair(builder.sign(self.pair.private_key, hashes.SHA256()), private_key)


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey, now: datetime, lifetime: timedelta
) -> x509.CertificateBuilder:
    """Return what all certificates have."""
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_SKEW)
        .not_valid_after(now + lifetime)
    )


def _key_usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _general_name(host: str) -> x509.GeneralName:
    """Return an address or a host name as a certificate writes it.

    Raises:
        InvalidValueError: It is neither.
    """
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        pass
    if not _HOST_NAME.fullmatch(host):
        message = f"'{host}' is neither the name nor the address of a machine; write --host router.example.org."
        raise InvalidValueError(message)
    return x509.DNSName(host)
