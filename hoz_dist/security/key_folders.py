"""The files of an authority: its own, and the folders that are carried to the machines of those it issues keys for.

A private key is readable by its owner alone from the first moment on, and its folder appears complete or not at all.
"""

import os
import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Final

from filelock import FileLock

from hoz_dist.atomic import TEMPORARY_SUFFIX, replace_file
from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.security.authority import Authority, KeyPair
from hoz_dist.security.register import REGISTER_FILE, Identity, Register, check_identity
from hoz_dist.security.router_file import router_file
from hoz_dist.wire.transport.credentials import (
    AUTHORITY_FILE,
    CERTIFICATE_FILE,
    KEY_FILE,
    ROLES,
    ROUTER_FILE,
    common_name,
)
from hoz_dist.wire.transport.endpoint import DEFAULT_ENCRYPTED_ENDPOINT

AUTHORITY_KEY_FILE: Final = "ca.key"
_LOCK_FILE: Final = ".lock"
_OLD_SUFFIX: Final = ".old"
"""Of a key folder that another one takes the place of."""
_LEFT_OVER: Final = re.compile(
    rf"\.(?:(?P<of>(?:{'|'.join(ROLES)})-.+)|[0-9a-f]{{32}})(?P<suffix>{re.escape(_OLD_SUFFIX)}|{re.escape(TEMPORARY_SUFFIX)})"
)
"""Names of what a command that was killed may leave: of a key folder, or of a file. Nothing else is touched."""
_LOCAL_HOSTS: Final = ("localhost", "127.0.0.1")
"""In the certificate of every router."""


@dataclass(frozen=True)
class RouterPlace:
    """Where a router will be. What is left out is as it was when the router had a key before.

    Attributes:
        hosts: Names and addresses by which clients reach it, besides those of the machine itself.
        listen: Endpoints where it listens; for a new router the default one.
        at: Where its key folder will be on its machine; for a new router where it is made.
    """

    hosts: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    at: str | None = None

    def after(self, before: Identity | None, made_in: Path) -> "RouterPlace":
        """Return the whole place.

        Args:
            before: The router as it is in the register; None for a new one.
            made_in: Where its key folder is made.
        """
        hosts = self.hosts or (before.hosts if before else ())
        listen = self.listen or (before.listen if before else ())
        at = self.at or (before.at if before else "")
        return RouterPlace(
            tuple(dict.fromkeys((*_LOCAL_HOSTS, *hosts))),
            listen or (DEFAULT_ENCRYPTED_ENDPOINT,),
            at or str(made_in.absolute()),
        )


def create_authority(folder: Path) -> None:
    """Make an authority in a folder.

    Raises:
        InvalidValueError: One is there already.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    with _locked(folder):
        if any((folder / name).exists() for name in (AUTHORITY_FILE, AUTHORITY_KEY_FILE)):
            message = (
                f"'{folder}' has an authority already, and without it the keys that it issued are worth nothing; "
                "choose another folder."
            )
            raise InvalidValueError(message)
        pair = Authority.create().pair
        replace_file(folder / AUTHORITY_KEY_FILE, partial(_write_private, content=pair.private_key_pem))
        replace_file(folder / AUTHORITY_FILE, partial(_write, content=pair.certificate_pem))


def issue_keys(
    folder: Path,
    role: str,
    names: Sequence[str],
    lifetime: timedelta,
    place: RouterPlace | None = None,
    *,
    replace: bool = False,
) -> list[tuple[Identity, Path]]:
    """Make keys, and let their holders in at the routers.

    Args:
        folder: Folder of the authority; the key folders are made in it.
        role: Role of the holders.
        names: Their names.
        lifetime: How long the keys are valid.
        place: Where the holders are, if they are routers.
        replace: Whether a name that has a key folder gets a new one instead.

    Returns:
        Everybody's identity and key folder, in the order of the names.

    Raises:
        NotFoundError: There is no authority in the folder.
        DamagedFileError: Its files cannot be read.
        UnknownNameError: There is no such role.
        InvalidValueError: A name cannot be one, or has a key folder already.
    """
    for name in names:
        check_identity(role, name)
    with _locked(_authority_folder(folder)):
        authority, register = _load_authority(folder), Register(folder)
        targets = {name: folder / common_name(role, name) for name in names}
        for name, target in targets.items():
            if target.exists() and not replace:
                message = f"The {role} '{name}' has a key already, '{target}'; add --replace to issue it anew."
                raise InvalidValueError(message)
        issued = []
        for name, target in targets.items():
            whole = place.after(register.find(role, name), target) if place else None
            issued.append((_issue(authority, role, name, lifetime, target, whole), target))
        register.add(*(identity for identity, _ in issued))
        _write_router_files(folder, register)
    return issued


def withdraw_key(folder: Path, role: str, name: str) -> None:
    """Strike somebody off, so that the routers, once started again, deny everything to the holder of the key.

    Args:
        folder: Folder of the authority.
        role: Role of the holder.
        name: Name of the holder.

    Raises:
        NotFoundError: There is no authority in the folder, or nobody of that name has a key.
        DamagedFileError: Its files cannot be read.
        UnknownNameError: There is no such role.
        InvalidValueError: The name cannot be one.
    """
    check_identity(role, name)
    with _locked(_authority_folder(folder)):
        register = Register(folder)
        struck_off = register.remove(role, name)
        shutil.rmtree(folder / common_name(role, name), ignore_errors=True)
        # Also when nobody was struck off: a withdrawal that was killed half-way is completed by the next one.
        _write_router_files(folder, register)
    if struck_off is None:
        message = f"No key was issued for the {role} '{name}'; see '{folder / REGISTER_FILE}' for who has one."
        raise NotFoundError(message)


def _authority_folder(folder: Path) -> Path:
    """Return the folder when it holds an authority.

    Raises:
        NotFoundError: It does not.
    """
    missing = [name for name in (AUTHORITY_FILE, AUTHORITY_KEY_FILE) if not (folder / name).is_file()]
    if missing:
        message = (
            f"'{folder}' holds no authority ({' and '.join(missing)} missing); make one with `hoz-dist keys init`."
        )
        raise NotFoundError(message)
    return folder


def _load_authority(folder: Path) -> Authority:
    return Authority.load((folder / AUTHORITY_FILE).read_bytes(), (folder / AUTHORITY_KEY_FILE).read_bytes())


def _issue(
    authority: Authority, role: str, name: str, lifetime: timedelta, target: Path, place: RouterPlace | None
) -> Identity:
    """Make one key and its folder."""
    place = place or RouterPlace()
    pair = authority.issue(common_name(role, name), place.hosts, lifetime)
    _replace_folder(target, authority, pair)
    return Identity(
        role=role,
        name=name,
        serial=f"{pair.certificate.serial_number:x}",
        expires=pair.certificate.not_valid_after_utc,
        hosts=place.hosts,
        listen=place.listen,
        at=place.at or "",
    )


def _replace_folder(target: Path, authority: Authority, pair: KeyPair) -> None:
    """Write a key folder beside its place, then put it there; if that fails, the old one is there again."""
    temporary, old = _beside(target, TEMPORARY_SUFFIX), _beside(target, _OLD_SUFFIX)
    try:
        temporary.mkdir(mode=0o700)
        _write_private(temporary / KEY_FILE, pair.private_key_pem)
        (temporary / CERTIFICATE_FILE).write_bytes(pair.certificate_pem)
        (temporary / AUTHORITY_FILE).write_bytes(authority.pair.certificate_pem)
        if target.exists():
            target.rename(old)
        temporary.rename(target)
    except BaseException:
        _put_back(target, old)
        raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    shutil.rmtree(old, ignore_errors=True)


def _beside(target: Path, suffix: str) -> Path:
    return target.with_name(f".{target.name}{suffix}")


def _put_back(target: Path, old: Path) -> None:
    """Give a folder that was moved aside its name again, unless a new one has it."""
    if old.is_dir() and not target.exists():
        old.rename(target)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Have the folder of an authority to oneself, without what a command that was killed has left there."""
    with FileLock(folder / _LOCK_FILE):
        _sweep(folder)
        yield


def _sweep(folder: Path) -> None:
    """Put key folders back that were moved aside for ones that never came, and delete the other left-overs."""
    for left_over in folder.glob(".*"):
        found = _LEFT_OVER.fullmatch(left_over.name)
        if found is None:
            continue
        if found["of"] and found["suffix"] == _OLD_SUFFIX:
            _put_back(folder / found["of"], left_over)
        if left_over.is_dir():
            shutil.rmtree(left_over, ignore_errors=True)
        else:
            left_over.unlink(missing_ok=True)


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def _write_private(path: Path, content: bytes) -> None:
    """Write a new file that nobody else can read at any time, whatever the user's umask."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)


def _write_router_files(folder: Path, register: Register) -> None:
    """Tell every router whose folder is here who has a key now."""
    for router in register.identities:
        path = folder / common_name(router.role, router.name) / ROUTER_FILE
        if router.role == "router" and path.parent.is_dir():
            replace_file(path, partial(_write, content=router_file(router, register.identities)))
