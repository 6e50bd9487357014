import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hoz_dist import __version__

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.integration


def run(*command: str | Path) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT)
    (built,) = folder.glob("*.whl")
    return built


def test_wheel_holds_all_packages_and_their_data(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert {f"{package}/py.typed" for package in ("hoz_dist", "workers", "learner")} <= names
    assert "hoz_dist/sim/catalogue.json" in names
    assert {name.partition("/")[0] for name in names} == {
        "hoz_dist",
        "workers",
        "learner",
        f"hoz_dist-{__version__}.dist-info",
    }
    packaged = {name for name in names if name.endswith(".py")}
    in_tree = {
        str(file.relative_to(ROOT)) for top in ("hoz_dist", "workers", "learner") for file in (ROOT / top).rglob("*.py")
    }
    assert packaged == in_tree


def test_wheel_declares_its_command_and_its_environment(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        entry_points = archive.read(f"hoz_dist-{__version__}.dist-info/entry_points.txt").decode()
    assert "[console_scripts]\nhoz-dist = hoz_dist.cli.main:main" in entry_points
    assert "[gymnasium.envs]\nhoz_dist = hoz_dist.sim.registration:register" in entry_points


def test_wheel_works_in_an_empty_environment(wheel: Path, tmp_path: Path) -> None:
    # Beside the wheel only click goes in: `hoz-dist --help` must need nothing else.
    environment = tmp_path / "venv"
    run(sys.executable, "-m", "venv", "--without-pip", environment)
    python = environment / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet")
    run(*pip, "--no-deps", wheel, "click")
    command = environment / "bin" / "hoz-dist"
    assert "Usage: hoz-dist" in run(command, "--help")
    assert run(command, "--version") == f"hoz-dist, version {__version__}\n"
    assert run(command, "scenes", "list").startswith("A room is named like kitchen/3.")
