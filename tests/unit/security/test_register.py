import json
from datetime import UTC, datetime
from pathlib import Path

import pytest

from hoz_dist.errors import DamagedFileError, InvalidValueError, UnknownNameError
from hoz_dist.security.register import LONGEST_NAME, REGISTER_FILE, Identity, Register

EXPIRES = datetime(2030, 1, 2, 3, 4, tzinfo=UTC)
ACTOR = Identity("actor", "a0", "1f", EXPIRES)
ROUTER = Identity("router", "r0", "2e", EXPIRES, ("localhost",), ("tls/0.0.0.0:7447",), "/etc/hoz/keys")


def test_it_remembers_who_has_a_key(tmp_path: Path) -> None:
    Register(tmp_path).add(ROUTER, ACTOR)
    assert Register(tmp_path).identities == (ACTOR, ROUTER)


def test_it_finds_who_has_a_key(tmp_path: Path) -> None:
    register = Register(tmp_path)
    register.add(ROUTER, ACTOR)
    assert register.find("router", "r0") == ROUTER
    assert register.find("router", "a0") is None


def test_a_key_that_is_issued_anew_replaces_the_old_one(tmp_path: Path) -> None:
    Register(tmp_path).add(ACTOR, ROUTER)
    renewed = Identity("actor", "a0", "3d", EXPIRES)
    Register(tmp_path).add(renewed)
    assert Register(tmp_path).identities == (renewed, ROUTER)


def test_who_is_struck_off_is_forgotten(tmp_path: Path) -> None:
    Register(tmp_path).add(ACTOR, ROUTER)
    assert Register(tmp_path).remove("actor", "a0") == ACTOR
    assert Register(tmp_path).identities == (ROUTER,)
    assert Register(tmp_path).remove("actor", "a0") is None


@pytest.mark.parametrize("content", ["", "{}", '{"issued": [{}]}', '{"issued": [{"role": "king"}]}'])
def test_a_damaged_register_is_said_in_one_sentence(tmp_path: Path, content: str) -> None:
    (tmp_path / REGISTER_FILE).write_text(content)
    with pytest.raises(DamagedFileError, match="is damaged; restore it"):
        Register(tmp_path)


def test_a_register_that_was_tampered_with_brings_no_key_expression_in(tmp_path: Path) -> None:
    Register(tmp_path).add(ACTOR)
    path = tmp_path / REGISTER_FILE
    content = json.loads(path.read_text())
    content["issued"][0]["name"] = "**"
    path.write_text(json.dumps(content))
    with pytest.raises(InvalidValueError, match="cannot be used on the network"):
        Register(tmp_path)


def test_names_fit_into_certificates_and_keys() -> None:
    Identity("learner", "a" * LONGEST_NAME, "1", EXPIRES)
    with pytest.raises(InvalidValueError, match=f"too long for a certificate: at most {LONGEST_NAME} characters"):
        Identity("learner", "a" * (LONGEST_NAME + 1), "1", EXPIRES)
    for name in ("*", "a/b", "@a", ""):
        with pytest.raises(InvalidValueError):
            Identity("actor", name, "1", EXPIRES)
    with pytest.raises(UnknownNameError, match=r"Unknown role 'actors'\. Did you mean 'actor'"):
        Identity("actors", "a0", "1", EXPIRES)
