"""Key folders: what a process shows to prove who it is, and what it asks the other side to prove.

A folder holds the certificate of the authority, the process's own certificate, and its private key. The certificate's
common name is ``ROLE-NAME``. `hoz-dist keys` makes such folders; here they are only read.
"""

import os
import stat
from collections.abc import Collection
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.x509.oid import NameOID

from hoz_dist.errors import DamagedFileError, InvalidValueError, NotFoundError

ROLES: Final = ("router", "learner", "actor", "viewer")
AUTHORITY_FILE: Final = "ca.pem"
CERTIFICATE_FILE: Final = "certificate.pem"
KEY_FILE: Final = "key.pem"
ROUTER_FILE: Final = "router.json5"
"""In the folder of a router: its whole configuration, with the access control."""


@dataclass(frozen=True)
class Credentials:
    """Who a process is on the network, and where its keys are; never what they are.

    Attributes:
        role: ``router``, ``learner``, ``actor`` or ``viewer``.
        name: Name of the process, unique within the role.
        folder: Where the files are.
        expires: Until when the certificate is valid.
    """

    role: str
    name: str
    folder: Path
    expires: datetime

    @property
    def authority(self) -> Path:
        """Certificate of the authority that signed this one, and must have signed that of the other side."""
        return self.folder / AUTHORITY_FILE

    @property
    def certificate(self) -> Path:
        """Own certificate."""
        return self.folder / CERTIFICATE_FILE

    @property
    def key(self) -> Path:
        """Own private key."""
        return self.folder / KEY_FILE

    @property
    def router_file(self) -> Path:
        """Configuration with the access control; only a router has one."""
        return self.folder / ROUTER_FILE

    def own_name(self, asked: str | None) -> str:
        """Return the name that the holder goes by: no router lets anything pass under another.

        Args:
            asked: The name that the user wants; None for no wish.

        Raises:
            InvalidValueError: It is another one.
        """
        if asked not in (None, self.name):
            message = (
                f"The key in '{self.folder}' is of the {self.role} '{self.name}', so that it cannot be '{asked}'; "
                "leave out --name, or give the key of that name."
            )
            raise InvalidValueError(message)
        return self.name


def common_name(role: str, name: str) -> str:
    """Return the common name of the certificates of a process; access control knows processes by it."""
    return f"{role}-{name}"


def load_credentials(folder: Path | str, roles: Collection[str] = ROLES) -> Credentials:
    """Read who a key folder makes of us.

    Args:
        folder: The folder.
        roles: Roles that are fit for what is to be done.

    Raises:
        NotFoundError: The folder or one of its files is missing.
        DamagedFileError: The certificate cannot be read, or was not made by `hoz-dist keys`.
        InvalidValueError: Others can read the private key, the certificate is expired or not valid yet, or it is of a
            role that is not fit.
    """
    folder = Path(folder).absolute()
    wanted = [AUTHORITY_FILE, CERTIFICATE_FILE, KEY_FILE]
    missing = [name for name in wanted if not (folder / name).is_file()]
    if missing:
        message = f"The key folder '{folder}' lacks {', '.join(missing)}; make one with `hoz-dist keys issue`."
        raise NotFoundError(message)
    certificate = check_key(folder / CERTIFICATE_FILE, folder / KEY_FILE)
    role, name = _identity(certificate, folder / CERTIFICATE_FILE)
    if role not in roles:
        message = f"The key in '{folder}' is of the {role} '{name}'; this needs one of the role {' or '.join(roles)}."
        raise InvalidValueError(message)
    return Credentials(role, name, folder, certificate.not_valid_after_utc)


def check_key(certificate: Path, key: Path) -> x509.Certificate:
    """Check that a certificate is valid now and that nobody else can read its private key.

    Args:
        certificate: File of the certificate.
        key: File of the private key.

    Returns:
        The certificate.

    Raises:
        NotFoundError: A file is missing.
        DamagedFileError: The certificate cannot be read.
        InvalidValueError: Others can read the private key, or the certificate is expired or not valid yet.
    """
    for path in (certificate, key):
        if not path.is_file():
            message = f"There is no '{path}'; make one with `hoz-dist keys issue`."
            raise NotFoundError(message)
    _check_private(key)
    found = _read_certificate(certificate)
    _check_time(found, certificate.parent)
    return found


def _check_private(key: Path) -> None:
    """Check that nobody else can read a private key.

    Of a key that belongs to somebody else, it is the group that may let us read it: so Kubernetes mounts secrets.
    """
    found = key.stat()
    others = stat.S_IRWXO | (stat.S_IRWXG if found.st_uid == os.geteuid() else 0)
    if found.st_mode & others:
        message = f"Others can read the private key '{key}'; run: chmod 600 '{key}'."
        raise InvalidValueError(message)


def _read_certificate(path: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except ValueError as error:
        message = f"'{path}' is not a certificate; issue the key anew with `hoz-dist keys issue`."
        raise DamagedFileError(message) from error


def _identity(certificate: x509.Certificate, path: Path) -> tuple[str, str]:
    """Return role and name.

    Args:
        certificate: Who it is.
        path: Its file, for the error.
    """
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    role, _, name = str(names[0].value if names else "").partition("-")
    if role not in ROLES or not name:
        message = f"The certificate '{path}' names no role of hoz-dist; issue one with `hoz-dist keys issue`."
        raise DamagedFileError(message)
    return role, name


def _check_time(certificate: x509.Certificate, folder: Path) -> None:
    """Check that a certificate is valid now."""
    now = datetime.now(UTC)
    if now >= certificate.not_valid_after_utc:
        message = (
            f"The key in '{folder}' expired on {certificate.not_valid_after_utc:%Y-%m-%d %H:%M} UTC; "
            "issue it anew with `hoz-dist keys issue`."
        )
        raise InvalidValueError(message)
    if now < certificate.not_valid_before_utc:
        message = (
            f"The key in '{folder}' is valid from {certificate.not_valid_before_utc:%Y-%m-%d %H:%M} UTC on; "
            "is the clock of this machine right?"
        )
        raise InvalidValueError(message)
