import json
import os
import re
import shutil
import stat
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509

from hoz_dist.errors import InvalidValueError, NotFoundError, UnknownNameError
from hoz_dist.security.key_folders import RouterPlace, create_authority, issue_keys, withdraw_key
from hoz_dist.security.register import Register
from hoz_dist.wire.transport.credentials import ROUTER_FILE, load_credentials
from hoz_dist.wire.transport.endpoint import DEFAULT_ENCRYPTED_ENDPOINT

DAY = timedelta(days=1)


@pytest.fixture(autouse=True)
def _careless_user() -> Iterator[None]:
    """A user whose new files anybody may read and write."""
    before = os.umask(0)
    yield
    os.umask(before)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    create_authority(tmp_path / "keys")
    return tmp_path / "keys"


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def subjects(folder: Path, router: str = "r0") -> set[str]:
    """Return who is known to a router."""
    found = set(re.findall(r'"cert_common_names": \[\s*"([^"]+)"', router_text(folder, router)))
    assert found == {subject["id"] for subject in router_config(folder, router)["access_control"]["subjects"]}
    return found


def hosts_of(folder: Path) -> set[str]:
    """Return what a router's certificate is valid for."""
    certificate = x509.load_pem_x509_certificate((folder / "certificate.pem").read_bytes())
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    return {str(name.value) for name in names}


def router_text(folder: Path, router: str = "r0") -> str:
    return (folder / f"router-{router}" / ROUTER_FILE).read_text()


def router_config(folder: Path, router: str = "r0") -> dict[str, Any]:
    config: dict[str, Any] = json.loads(re.sub(r"(?m)^//.*$", "", router_text(folder, router)))
    return config


def test_private_keys_are_their_owners_alone(folder: Path) -> None:
    [(_, actor)] = issue_keys(folder, "actor", ["a0"], DAY)
    assert mode(folder) == mode(actor) == 0o700
    assert mode(folder / "ca.key") == mode(actor / "key.pem") == 0o600
    assert load_credentials(actor).name == "a0"


def test_a_key_is_never_readable_by_others_while_it_is_written(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    modes, real = [], os.open

    def watched(path: Any, flags: int, permissions: int = 0o777, **others: Any) -> int:
        if flags & os.O_CREAT:
            modes.append(permissions)
        return real(path, flags, permissions, **others)

    monkeypatch.setattr(os, "open", watched)
    issue_keys(folder, "actor", ["a0"], DAY)
    assert 0o600 in modes
    [folder_of_key] = [path.parent for path in folder.rglob("key.pem")]
    assert [path.name for path in folder_of_key.parent.glob(".*.tmp")] == []


def test_an_authority_is_never_replaced(folder: Path) -> None:
    before = (folder / "ca.key").read_bytes()
    with pytest.raises(InvalidValueError, match="has an authority already"):
        create_authority(folder)
    (folder / "ca.pem").unlink()
    with pytest.raises(InvalidValueError, match="has an authority already"):
        create_authority(folder)
    assert (folder / "ca.key").read_bytes() == before


def test_without_an_authority_nothing_is_issued(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"holds no authority \(ca.pem and ca.key missing\); make one"):
        issue_keys(tmp_path, "actor", ["a0"], DAY)


def test_several_keys_are_issued_at_once_or_none(folder: Path) -> None:
    issued = issue_keys(folder, "actor", ["a0", "a1"], DAY)
    assert [path.name for _, path in issued] == ["actor-a0", "actor-a1"]
    assert len({identity.serial for identity, _ in issued}) == 2
    with pytest.raises(InvalidValueError, match=r"The actor 'a1' has a key already, .*; add --replace"):
        issue_keys(folder, "actor", ["a2", "a1"], DAY)
    with pytest.raises(InvalidValueError, match="cannot be used on the network"):
        issue_keys(folder, "actor", ["a2", "**"], DAY)
    assert not (folder / "actor-a2").exists()
    assert len(Register(folder).identities) == 2


def test_an_unknown_role_is_refused(folder: Path) -> None:
    with pytest.raises(UnknownNameError, match="Unknown role 'acter'"):
        issue_keys(folder, "acter", ["a0"], DAY)


def test_a_key_is_replaced_when_that_is_wanted(folder: Path) -> None:
    [(old, path)] = issue_keys(folder, "actor", ["a0"], DAY)
    key = (path / "key.pem").read_bytes()
    [(new, again)] = issue_keys(folder, "actor", ["a0"], 2 * DAY, replace=True)
    assert again == path
    assert (path / "key.pem").read_bytes() != key
    assert new.serial != old.serial
    assert Register(folder).identities == (new,)
    assert sorted(one.name for one in folder.iterdir()) == [".lock", "actor-a0", "ca.key", "ca.pem", "issued.json"]


@pytest.mark.parametrize("failing", [1, 2])
@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError])
def test_the_old_key_stays_when_a_new_one_cannot_take_its_place(
    folder: Path, monkeypatch: pytest.MonkeyPatch, failing: int, error: type[BaseException]
) -> None:
    [(_, path)] = issue_keys(folder, "actor", ["a0"], DAY)
    key, real, renamed = (path / "key.pem").read_bytes(), Path.rename, []

    def fails_once(source: Path, target: Path) -> Path:
        renamed.append(target)
        if len(renamed) == failing:
            raise error
        return real(source, target)

    monkeypatch.setattr(Path, "rename", fails_once)
    with pytest.raises(error):
        issue_keys(folder, "actor", ["a0"], DAY, replace=True)
    assert (path / "key.pem").read_bytes() == key
    assert sorted(one.name for one in folder.glob(".*")) == [".lock"]


def test_what_a_killed_command_left_is_swept_by_the_next(folder: Path) -> None:
    issue_keys(folder, "actor", ["a0", "a1", "a2"], DAY)
    key = (folder / "actor-a0" / "key.pem").read_bytes()
    (folder / "actor-a0").rename(folder / ".actor-a0.old")  # killed between the two renames
    (folder / "actor-a1").rename(folder / ".actor-a1.tmp")  # before the first
    shutil.copytree(folder / "actor-a2", folder / ".actor-a2.old")  # after the second
    shutil.copytree(folder / "actor-a2", folder / f".{'0123456789abcdef' * 2}.old")  # of an earlier release
    (folder / f".{'0123456789abcdef' * 2}.tmp").write_text("half a register")
    (folder / ".somebodys.old").mkdir()
    issue_keys(folder, "viewer", ["v0"], DAY)
    assert (folder / "actor-a0" / "key.pem").read_bytes() == key
    assert sorted(one.name for one in folder.iterdir()) == [
        ".lock", ".somebodys.old", "actor-a0", "actor-a2", "ca.key", "ca.pem", "issued.json", "viewer-v0",
    ]  # fmt: skip


def test_a_withdrawn_key_does_not_come_back(folder: Path) -> None:
    issue_keys(folder, "actor", ["a0"], DAY)
    (folder / "actor-a0").rename(folder / ".actor-a0.old")
    withdraw_key(folder, "actor", "a0")
    issue_keys(folder, "viewer", ["v0"], DAY)
    assert list(folder.rglob("key.pem")) == [folder / "viewer-v0" / "key.pem"]


def test_every_router_knows_who_has_a_key(folder: Path) -> None:
    issue_keys(folder, "actor", ["a0"], DAY)
    issue_keys(folder, "router", ["r0", "r1"], DAY, RouterPlace())
    issue_keys(folder, "viewer", ["v0"], DAY)
    for router in ("r0", "r1"):
        assert subjects(folder, router) == {"actor-a0", "router-r0", "router-r1", "viewer-v0"}


def test_a_withdrawn_key_is_known_to_no_router(folder: Path) -> None:
    issue_keys(folder, "router", ["r0"], DAY, RouterPlace())
    issue_keys(folder, "actor", ["a0", "a1"], DAY)
    withdraw_key(folder, "actor", "a0")
    assert subjects(folder) == {"router-r0", "actor-a1"}
    assert "/a0" not in router_text(folder)
    assert not (folder / "actor-a0").exists()
    with pytest.raises(NotFoundError, match="No key was issued for the actor 'a0'"):
        withdraw_key(folder, "actor", "a0")


def test_a_withdrawal_that_was_interrupted_is_completed_by_the_next(folder: Path) -> None:
    issue_keys(folder, "router", ["r0"], DAY, RouterPlace())
    issue_keys(folder, "actor", ["a0"], DAY)
    Register(folder).remove("actor", "a0")  # all that was done before it was killed
    with pytest.raises(NotFoundError):
        withdraw_key(folder, "actor", "a0")
    assert subjects(folder) == {"router-r0"}
    assert not (folder / "actor-a0").exists()


def test_a_routers_file_says_where_it_will_be(folder: Path) -> None:
    place = RouterPlace(("router.lab",), ("tls/0.0.0.0:7447", "tls/0.0.0.0:443"), "/etc/hoz/keys")
    issue_keys(folder, "router", ["r0"], DAY, place)
    issue_keys(folder, "actor", ["a0"], DAY)  # written anew
    config = router_config(folder)
    assert config["listen"]["endpoints"] == ["tls/0.0.0.0:7447", "tls/0.0.0.0:443"]
    tls = config["transport"]["link"]["tls"]
    assert tls["listen_private_key"] == "/etc/hoz/keys/key.pem"
    assert tls["listen_certificate"] == "/etc/hoz/keys/certificate.pem"
    assert tls["root_ca_certificate"] == "/etc/hoz/keys/ca.pem"
    assert tls["enable_mtls"] is tls["close_link_on_expiration"] is True
    [router] = [one for one in Register(folder).identities if one.role == "router"]
    assert router.hosts == ("localhost", "127.0.0.1", "router.lab")


def test_a_router_stays_where_it_is_unless_it_is_said_otherwise(folder: Path) -> None:
    place = RouterPlace(("router.lab",), ("tls/0.0.0.0:443",), "/etc/keys")
    [(old, _)] = issue_keys(folder, "router", ["r0"], DAY, place)
    [(new, path)] = issue_keys(folder, "router", ["r0"], DAY, RouterPlace(), replace=True)
    assert (new.hosts, new.listen, new.at) == (old.hosts, old.listen, old.at)
    assert hosts_of(path) == {"localhost", "127.0.0.1", "router.lab"}
    assert router_config(folder)["listen"]["endpoints"] == ["tls/0.0.0.0:443"]

    moved = RouterPlace(("gate.lab",), at="/keys")
    [(new, path)] = issue_keys(folder, "router", ["r0"], DAY, moved, replace=True)
    assert (new.hosts, new.listen, new.at) == (("localhost", "127.0.0.1", "gate.lab"), ("tls/0.0.0.0:443",), "/keys")
    assert hosts_of(path) == {"localhost", "127.0.0.1", "gate.lab"}


def test_a_new_router_has_defaults(folder: Path) -> None:
    [(router, path)] = issue_keys(folder, "router", ["r0"], DAY, RouterPlace())
    assert (router.hosts, router.listen) == (("localhost", "127.0.0.1"), (DEFAULT_ENCRYPTED_ENDPOINT,))
    assert router.at == str(path)


def test_a_routers_file_holds_no_key(folder: Path) -> None:
    issue_keys(folder, "router", ["r0"], DAY, RouterPlace())
    secret = (folder / "router-r0" / "key.pem").read_text().splitlines()[1]
    for path in (folder / "router-r0" / ROUTER_FILE, folder / "issued.json"):
        assert secret not in path.read_text()
        assert "PRIVATE" not in path.read_text()
