from importlib.metadata import version as installed_version
from typing import Any

import jsonschema
import pytest
from check_jsonschema.builtin_schemas import get_builtin_schema

from hoz_dist import __version__
from tests.unit.deploy.reading import DEPLOY, compose_file, filled_in, parse

PLAIN, KEYS = compose_file("compose.yaml"), compose_file("compose.tls.yaml")
SERVICES: dict[str, dict[str, Any]] = PLAIN["services"]
OURS = ("learner", "standby", "actor")
VALUES = {"HOZ_RUN:-default": "default"}


def with_keys(service: str) -> dict[str, Any]:
    """Return a service as both files together have it, as far as these tests look."""
    plain, keys = SERVICES[service], KEYS["services"][service]
    volumes: list[str] = plain.get("volumes", []) + keys["volumes"]
    return {**plain, **keys, "volumes": volumes}


@pytest.mark.parametrize("file", [PLAIN, KEYS], ids=["plain", "keys"])
def test_files_follow_the_compose_specification(file: dict[str, Any]) -> None:
    jsonschema.validate(file, get_builtin_schema("vendor.compose-spec"))


@pytest.mark.parametrize("service", OURS)
def test_commands_exist(service: str) -> None:
    parse(filled_in(SERVICES[service]["command"], VALUES))
    # take-name adds what makes copies differ.
    parse(filled_in(with_keys(service)["command"], VALUES))


@pytest.mark.parametrize("services", [SERVICES, {name: with_keys(name) for name in SERVICES}], ids=["plain", "keys"])
def test_health_checks_exist_or_are_off(services: dict[str, dict[str, Any]]) -> None:
    for name in ("learner", "standby"):
        _, command, *words = services[name]["healthcheck"]["test"]
        assert command == "hoz-dist"
        parse(words)
    # The image's own check asks a learner that listens itself.
    assert services["actor"]["healthcheck"] == {"disable": True}
    assert services["router"]["healthcheck"]["test"][-1] == "7447"


@pytest.mark.parametrize("service", SERVICES)
def test_processes_may_do_little(service: str) -> None:
    settings = SERVICES[service]
    assert settings["cap_drop"] == ["ALL"]
    assert settings["security_opt"] == ["no-new-privileges:true"]
    assert settings["read_only"]
    assert settings["init"]
    assert settings["deploy"]["resources"]["limits"].keys() == {"memory", "pids"}
    # Ours run as the image's user.
    assert service in OURS or settings["user"] == "10001:10001"


def test_everybody_is_started_again_but_an_actor_that_is_done() -> None:
    assert {name: SERVICES[name]["restart"] for name in SERVICES} == {
        "router": "unless-stopped",
        "learner": "unless-stopped",
        "standby": "unless-stopped",
        "actor": "on-failure",
    }


def test_learners_share_the_run_and_have_time_for_the_last_checkpoint() -> None:
    for name in ("learner", "standby"):
        assert SERVICES[name]["volumes"] == ["runs:/runs"]
        assert int(SERVICES[name]["stop_grace_period"].removesuffix("s")) >= 30
        assert "--standby" in SERVICES[name]["command"]
    names = [
        SERVICES[name]["command"][SERVICES[name]["command"].index("--name") + 1] for name in ("learner", "standby")
    ]
    assert len(set(names)) == 2


def test_images_are_of_this_version() -> None:
    assert {SERVICES[name]["image"] for name in OURS} == {f"hoz-dist:{__version__}"}
    image, _, version = SERVICES["router"]["image"].partition(":")
    assert image == "eclipse/zenoh"
    assert version.rpartition(".")[0] == installed_version("eclipse-zenoh").rpartition(".")[0]


def test_only_keys_open_the_router_to_other_machines() -> None:
    assert SERVICES["router"]["ports"] == ["127.0.0.1:7447:7447"]
    for service in OURS:
        words = with_keys(service)["command"]
        assert not any("tcp/" in word for word in words)
        assert any("tls/router:7447" in word for word in words)
    assert "tls/router:7447" in with_keys("learner")["healthcheck"]["test"]


@pytest.mark.parametrize("service", SERVICES)
def test_keys_cannot_be_written(service: str) -> None:
    (mounted,) = [volume for volume in with_keys(service)["volumes"] if ":/keys" in volume]
    assert mounted.startswith("${HOZ_KEYS")
    assert mounted.endswith(":ro")


def test_what_is_mounted_from_here_exists() -> None:
    assert (DEPLOY / SERVICES["router"]["volumes"][0].partition(":")[0]).is_file()
    assert {volume.partition(":")[0] for name in OURS for volume in SERVICES[name]["volumes"]} == set(PLAIN["volumes"])
