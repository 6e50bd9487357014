import configparser
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.deploy.reading import DEPLOY, environment_file, filled_in, parse, process_settings

FOLDER = DEPLOY / "systemd"
UNITS = {
    "hoz-router.service": "hoz-router",
    "hoz-learner@.service": "hoz-learner@a",
    "hoz-actor@.service": "hoz-actor@0",
}
BINARY = "/opt/hoz-dist/bin/hoz-dist"

ANALYZE = shutil.which("systemd-analyze") or ""

needs_systemd = pytest.mark.skipif(not ANALYZE, reason="systemd-analyze is not installed")


def service(unit: str) -> dict[str, str]:
    """Return the settings of a unit's service, the last of several."""
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # the documented way to keep the case
    parser.read_string((FOLDER / unit).read_text().replace("\\\n", " "))
    return dict(parser["Service"])


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder with all units as instances, of a hoz-dist that is installed."""
    for unit, instance in UNITS.items():
        text = (FOLDER / unit).read_text().replace(BINARY, sys.executable)
        (tmp_path / f"{instance}.service").write_text(text)
    return tmp_path


@needs_systemd
@pytest.mark.parametrize("instance", UNITS.values())
def test_systemd_has_nothing_to_say(installed: Path, instance: str) -> None:
    done = subprocess.run(
        [ANALYZE, "verify", "--man=no", installed / f"{instance}.service"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


@needs_systemd
@pytest.mark.parametrize("instance", UNITS.values())
def test_services_may_do_little(installed: Path, instance: str) -> None:
    # Tenths: 0 may do nothing, 100 everything.
    command: list[str | Path] = [
        ANALYZE,
        "security",
        "--offline=yes",
        "--threshold=20",
        installed / f"{instance}.service",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("unit", UNITS)
def test_commands_exist(unit: str) -> None:
    values = environment_file(FOLDER / "hoz-dist.env")
    binary, *words = shlex.split(service(unit)["ExecStart"])
    assert binary == BINARY
    # systemd splits $NAME alone into words.
    split = [part for word in words for part in (shlex.split(values[word[1:]]) if word[1:] in values else [word])]
    parse(filled_in(split, values | {"%i": "0"}))


def test_processes_get_the_environment_that_they_need() -> None:
    assert environment_file(DEPLOY / "process.env") == process_settings()
    assert all("EnvironmentFile=/etc/hoz-dist/process.env\n" in (FOLDER / unit).read_text() for unit in UNITS)


def test_services_come_back() -> None:
    restarts = {unit: service(unit)["Restart"] for unit in UNITS}
    # An actor whose run is over ends without a failure.
    assert restarts == {
        "hoz-router.service": "always",
        "hoz-learner@.service": "always",
        "hoz-actor@.service": "on-failure",
    }
    assert all("\nStartLimitIntervalSec=0\n" in (FOLDER / unit).read_text() for unit in UNITS)
    assert int(service("hoz-learner@.service")["TimeoutStopSec"]) >= 30


@pytest.mark.parametrize("unit", UNITS)
def test_nothing_runs_as_root(unit: str) -> None:
    assert service(unit)["User"] == "hoz"
