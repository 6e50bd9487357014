import os
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from hoz_dist.errors import DamagedFileError, InvalidValueError, NotFoundError
from hoz_dist.security.authority import Authority
from hoz_dist.security.key_folders import create_authority, issue_keys
from hoz_dist.wire.transport.credentials import AUTHORITY_FILE, CERTIFICATE_FILE, KEY_FILE, load_credentials

DAY = timedelta(days=1)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    create_authority(tmp_path)
    [(_, folder)] = issue_keys(tmp_path, "actor", ["a-0"], DAY)
    return folder


def write_certificate(folder: Path, common_name: str, lifetime: timedelta = DAY, now: datetime | None = None) -> None:
    pair = Authority.create().issue(common_name, (), lifetime, now)
    (folder / CERTIFICATE_FILE).write_bytes(pair.certificate_pem)


def test_a_key_folder_says_who_we_are(folder: Path) -> None:
    credentials = load_credentials(folder)
    assert (credentials.role, credentials.name) == ("actor", "a-0")
    assert credentials.folder == folder
    assert timedelta() < credentials.expires - datetime.now(UTC) <= DAY
    assert load_credentials(str(folder)) == credentials


def test_paths_do_not_depend_on_where_we_are(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder.parent)
    assert load_credentials(Path(folder.name)).key == folder / KEY_FILE


def test_printing_shows_no_key(folder: Path) -> None:
    shown = repr(load_credentials(folder))
    assert "a-0" in shown
    assert all(line not in shown for line in (folder / KEY_FILE).read_text().splitlines())


@pytest.mark.parametrize("name", [AUTHORITY_FILE, CERTIFICATE_FILE, KEY_FILE])
def test_a_missing_file_is_named(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(NotFoundError, match=f"The key folder '{folder}' lacks {name}; make one with"):
        load_credentials(folder)


def test_a_missing_folder_is_said(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"lacks ca\.pem, certificate\.pem, key\.pem"):
        load_credentials(tmp_path / "none")


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o644, 0o777])
def test_a_key_that_others_can_read_is_refused(folder: Path, mode: int) -> None:
    key = folder / KEY_FILE
    key.chmod(mode)
    with pytest.raises(InvalidValueError, match=f"Others can read the private key '{key}'; run: chmod 600 '{key}'"):
        load_credentials(folder)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
def test_a_key_of_another_owner_may_be_readable_by_the_group(folder: Path) -> None:
    # So Kubernetes mounts a secret: it belongs to root, and the group of the pod may read it.
    key = folder / KEY_FILE
    os.chown(key, 12345, -1)
    key.chmod(0o440)
    assert load_credentials(folder).name == "a-0"
    key.chmod(0o444)
    with pytest.raises(InvalidValueError, match="Others can read"):
        load_credentials(folder)


def test_an_expired_key_is_said_at_once(folder: Path) -> None:
    write_certificate(folder, "actor-a0", now=datetime(2024, 5, 6, 7, 8, tzinfo=UTC))
    with pytest.raises(InvalidValueError, match="expired on 2024-05-07 07:08 UTC; issue it anew"):
        load_credentials(folder)


def test_a_wrong_clock_is_suspected(folder: Path) -> None:
    write_certificate(folder, "actor-a0", now=datetime.now(UTC) + DAY)
    with pytest.raises(InvalidValueError, match=r"is valid from .* UTC on; is the clock of this machine right\?"):
        load_credentials(folder)


def test_a_role_that_does_not_fit_is_refused(folder: Path) -> None:
    assert load_credentials(folder, ["viewer", "actor"]).role == "actor"
    with pytest.raises(InvalidValueError, match="is of the actor 'a-0'; this needs one of the role viewer or learner"):
        load_credentials(folder, ["viewer", "learner"])


@pytest.mark.parametrize("common_name", ["somebody", "king-a0", "actor-"])
def test_a_certificate_of_another_making_is_refused(folder: Path, common_name: str) -> None:
    write_certificate(folder, common_name)
    with pytest.raises(DamagedFileError, match="names no role of hoz-dist"):
        load_credentials(folder)


def test_a_damaged_certificate_is_said(folder: Path) -> None:
    (folder / CERTIFICATE_FILE).write_bytes((folder / KEY_FILE).read_bytes())
    with pytest.raises(DamagedFileError, match="is not a certificate") as caught:
        load_credentials(folder)
    assert "PRIVATE" not in str(caught.value)


def test_the_holder_goes_by_the_name_of_its_key(folder: Path) -> None:
    credentials = load_credentials(folder)
    assert credentials.own_name(None) == credentials.own_name("a-0") == "a-0"
    with pytest.raises(InvalidValueError, match="so that it cannot be 'a1'; leave out --name"):
        credentials.own_name("a1")
