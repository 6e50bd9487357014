import json
import re
import subprocess
import sys
from pathlib import Path

from tests.unit.deploy.reading import DEPLOY, ROOT, parse, process_settings

DOCKERFILE = (DEPLOY / "Dockerfile").read_text()
STAGES = DOCKERFILE.split("\nFROM ")
TOOLS = Path(sys.executable).parent


def joined(stage: str) -> list[str]:
    """Return the instructions of a stage, one a line, without comments."""
    lines = "\n".join(line for line in stage.splitlines() if not line.lstrip().startswith("#"))
    return [line.strip() for line in lines.replace("\\\n", " ").splitlines() if line.strip()]


def the(instruction: str) -> str:
    """Return what the only such instruction of the last stage says."""
    (found,) = [line for line in joined(STAGES[-1]) if line.startswith(f"{instruction} ")]
    return found.removeprefix(f"{instruction} ")


def test_a_linter_has_nothing_to_say() -> None:
    done = subprocess.run([TOOLS / "hadolint", DEPLOY / "Dockerfile"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_environment_is_that_of_every_process() -> None:
    (line,) = [line for line in joined(STAGES[-1]) if line.startswith("ENV ")]
    said = {name: quoted or plain for name, quoted, plain in re.findall(r'([A-Z_]+)=(?:"([^"]*)"|(\S+))', line)}
    settings = process_settings()
    assert {name: said.get(name) for name in settings} == settings


def test_runs_as_nobody_and_without_compilers() -> None:
    user, _, group = the("USER").partition(":")
    assert user == group == "10001"
    # What compiles and what fetches stays in the stage before.
    last = "\n".join(joined(STAGES[-1]))
    assert not re.search(r"\b(apt-get|gcc|pip|curl|git)\b", last)
    assert "COPY --from=build /opt/hoz-dist /opt/hoz-dist" in last


def test_folders_that_are_written_belong_to_the_user() -> None:
    volumes = json.loads(the("VOLUME"))
    (run,) = [line for line in joined(STAGES[-1]) if line.startswith("RUN ")]
    assert all(f" {volume}" in run.partition("--owner hoz")[2] for volume in volumes)


def test_runs_commands_that_exist() -> None:
    assert json.loads(the("ENTRYPOINT")) == ["hoz-dist"]
    parse(json.loads(the("CMD")))
    _, _, health = the("HEALTHCHECK").partition("CMD ")
    name, *words = json.loads(health)
    assert name == "hoz-dist"
    parse(words)


def test_copies_only_what_the_builder_is_sent() -> None:
    sent = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    copied = {
        source
        for stage in STAGES
        for line in joined(stage)
        if line.startswith("COPY ") and "--from" not in line
        for source in line.split()[1:-1]
        if not source.startswith("--")
    }
    assert copied == sent
    assert all((ROOT / source).exists() for source in copied)
