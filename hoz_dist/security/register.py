"""The register of an authority: for whom it has issued keys. The access control follows from it."""

import json
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from hoz_dist.atomic import replace_file
from hoz_dist.errors import DamagedFileError, InvalidValueError, UnknownNameError
from hoz_dist.wire.protocol.keys import check_name
from hoz_dist.wire.transport.credentials import ROLES

REGISTER_FILE: Final = "issued.json"
LONGEST_NAME: Final = 64 - len("learner-")
"""A certificate's common name, ``ROLE-NAME``, holds 64 characters."""


@dataclass(frozen=True)
class Identity:
    """Somebody for whom a key was issued.

    Attributes:
        role: ``router``, ``learner``, ``actor`` or ``viewer``.
        name: Unique within the role.
        serial: Serial number of the newest certificate, hexadecimal.
        expires: Until when that is valid.
        hosts: Of a router: names and addresses that its certificate is valid for.
        listen: Of a router: endpoints where it listens.
        at: Of a router: where its key folder is on its machine.
    """

    role: str
    name: str
    serial: str
    expires: datetime
    hosts: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    at: str = ""

    def __post_init__(self) -> None:
        check_identity(self.role, self.name)


def check_identity(role: str, name: str) -> None:
    """Check that a key can be issued for a role and name.

    Raises:
        UnknownNameError: There is no such role.
        InvalidValueError: The name is not fit for a key expression and a certificate.
    """
    if role not in ROLES:
        raise UnknownNameError.of("role", role, ROLES)
    check_name(role, name)
    if len(name) > LONGEST_NAME:
        message = f"The {role} name '{name}' is too long for a certificate: at most {LONGEST_NAME} characters."
        raise InvalidValueError(message)


class Register:
    """Who has keys of an authority; kept in a file that holds no secrets.

    Args:
        folder: Folder of the authority.

    Raises:
        DamagedFileError: The file cannot be read as a register.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / REGISTER_FILE
        self._identities: dict[tuple[str, str], Identity] = {}
        if not self._path.exists():
            return
        try:
            for entry in json.loads(self._path.read_text(encoding="utf-8"))["issued"]:
                self._keep(_identity(**entry))
        except (ValueError, KeyError, TypeError) as error:
            message = f"'{self._path}' is damaged; restore it from a copy, or issue the keys anew."
            raise DamagedFileError(message) from error

    @property
    def identities(self) -> tuple[Identity, ...]:
        """All of them, sorted by role and name."""
        return tuple(self._identities[key] for key in sorted(self._identities))

    def find(self, role: str, name: str) -> Identity | None:
        """Return somebody; None when nobody of that name is known."""
        return self._identities.get((role, name))

    def add(self, *identities: Identity) -> None:
        """Write down that keys were issued; who was known already is replaced."""
        for identity in identities:
            self._keep(identity)
        self._save()

    def remove(self, role: str, name: str) -> Identity | None:
        """Strike somebody off; None when nobody of that name is known."""
        identity = self._identities.pop((role, name), None)
        self._save()
        return identity

    def _keep(self, identity: Identity) -> None:
        self._identities[identity.role, identity.name] = identity

    def _save(self) -> None:
        issued = [asdict(identity) | {"expires": identity.expires.isoformat()} for identity in self.identities]
        content = json.dumps({"issued": issued}, indent=2) + "\n"
        replace_file(self._path, lambda path: path.write_text(content, encoding="utf-8"))


def _identity(*, expires: str, hosts: list[str], listen: list[str], **others: str) -> Identity:
    """Return an identity as the file tells it."""
    return Identity(expires=datetime.fromisoformat(expires), hosts=tuple(hosts), listen=tuple(listen), **others)
