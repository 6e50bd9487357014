import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from tests.unit.deploy.reading import DEPLOY, ROOT, parse, process_settings
from tests.waiting import until

FOLDER = DEPLOY / "slurm"
RUN, ACTORS = FOLDER / "run.sbatch", FOLDER / "actors.sbatch"
TOOLS = Path(sys.executable).parent
NOTE = f"""#!{sys.executable}
import json, os, sys
line = json.dumps([os.path.basename(sys.argv[0]), *sys.argv[1:]])
with open(os.environ["NOTES"], "a") as notes:
    notes.write(line + "\\n")
"""
"""A command that notes how it was called."""
OVER = "print('\"finished\": true\\n' + ' ' * 100_000)\n"
"""What `hoz-dist status` says of a run that is over, with more after it than a pipe holds."""
STAYS = "import signal\nsignal.signal(signal.SIGTERM, lambda *_: sys.exit(0))\nwhile True: signal.pause()\n"
"""After the note: work until SIGTERM."""


class Cluster:
    """A node with Slurm's commands, and a `hoz-dist` that notes its words and ends at once, or when it is told to."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.bin = folder / "bin"
        self.bin.mkdir()
        self.notes = folder / "notes"
        self.notes.touch()
        self.command("hoz-dist", NOTE + OVER)
        self.command("srun", '#!/bin/sh\nwhile [ "$1" != hoz-dist ]; do shift; done\nexec "$@"\n')
        self.command("scontrol", NOTE)
        self.command("scancel", NOTE)
        # The state of the job, running.
        self.command("squeue", "#!/bin/sh\necho R\n")
        # Pauses are skipped.
        self.command("sleep", "#!/bin/sh\n")

    def command(self, name: str, script: str) -> None:
        path = self.bin / name
        path.write_text(script)
        path.chmod(0o755)

    def called(self, name: str) -> list[list[str]]:
        """Return the words of each call of a command."""
        calls = [json.loads(line) for line in self.notes.read_text().splitlines()]
        return [words for command, *words in calls if command == name]

    def start(self, script: Path, *words: str, **environment: str) -> subprocess.Popen[bytes]:
        variables = {
            "PATH": f"{self.bin}:{os.environ['PATH']}",
            "NOTES": str(self.notes),
            "USER": "somebody",
            "SLURM_SUBMIT_DIR": str(ROOT),
            "SLURM_JOB_ID": "7",
            "SLURM_ARRAY_JOB_ID": "8",
            "SLURM_ARRAY_TASK_ID": "3",
            "HOZ_RUN": str(self.folder / "runs" / "kitchens"),
        }
        return subprocess.Popen(["/bin/bash", script, *words], env=variables | environment)

    def run(self, script: Path, *words: str, **environment: str) -> None:
        assert self.start(script, *words, **environment).wait(20) == 0

    @property
    def endpoint(self) -> Path:
        return self.folder / "runs" / "kitchens.endpoint"


@pytest.fixture
def cluster(tmp_path: Path) -> Cluster:
    return Cluster(tmp_path)


def option(words: list[str], name: str) -> str:
    return words[words.index(name) + 1]


@pytest.mark.parametrize("script", [RUN, ACTORS, DEPLOY / "take-name"], ids=lambda path: path.name)
def test_a_linter_has_nothing_to_say(script: Path) -> None:
    command: list[str | Path] = [TOOLS / "shellcheck", "--external-sources", "--source-path", ROOT, script]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("script", [RUN, ACTORS], ids=lambda path: path.name)
def test_jobs_ask_to_be_started_again_after_preemption_and_before_their_time_is_over(script: Path) -> None:
    options = [line.removeprefix("#SBATCH ") for line in script.read_text().splitlines() if line.startswith("#SBATCH ")]
    assert "--requeue" in options
    assert "--open-mode=append" in options
    assert any(line.startswith("--signal=B:TERM@") for line in options)


@pytest.mark.parametrize("keys", [{}, {"HOZ_KEYS": "/keys"}], ids=["plain", "keys"])
def test_run_starts_a_router_and_two_learners_of_it(cluster: Cluster, keys: Mapping[str, str]) -> None:
    cluster.run(RUN, "--model", "hoz", "--minutes", "600", **keys)
    started = cluster.called("hoz-dist")
    for words in started:
        parse(words)
    assert sorted(words[0] for words in started) == ["learner", "learner", "router"]
    endpoint = cluster.endpoint.read_text().strip()
    assert endpoint.startswith("tls/" if keys else "tcp/")
    learners = [words for words in started if words[0] == "learner"]
    assert {option(words, "--name") for words in learners} == {"a", "b"}
    for words in learners:
        assert option(words, "--connect") == endpoint
        assert "--standby" in words
        assert option(words, "--minutes") == "600"
        assert not keys or option(words, "--keys") == f"/keys/learner-{option(words, '--name')}"


def test_steps_of_the_run_run_side_by_side(cluster: Cluster) -> None:
    """A step that does not say what it needs takes all memory of the job, and the next one waits for it."""
    cluster.command("srun", NOTE)
    cluster.run(RUN)
    steps = [words[: words.index("hoz-dist")] for words in cluster.called("srun")]
    assert len(steps) == 3
    assert all("--exact" in words for words in steps)
    (of_the_job,) = re.findall(r"^#SBATCH --mem=(\d+)G$", RUN.read_text(), re.MULTILINE)
    needed = [int(word.removeprefix("--mem=").removesuffix("G")) for words in steps for word in words if "mem" in word]
    assert len(needed) == 3
    assert sum(needed) <= int(of_the_job)


@pytest.mark.parametrize("script", [RUN, ACTORS], ids=lambda path: path.name)
def test_processes_get_the_environment_that_they_need(cluster: Cluster, script: Path) -> None:
    show = "json.dump(dict(os.environ), open(os.environ['NOTES'] + '.environment', 'w'))\n"
    cluster.command("hoz-dist", NOTE + show + OVER)
    cluster.endpoint.parent.mkdir()
    cluster.endpoint.write_text("tcp/node1:7447\n")
    cluster.run(script)
    found = json.loads((cluster.folder / "notes.environment").read_text())
    assert {name: found.get(name) for name in process_settings()} == process_settings()


def test_a_killed_process_of_the_run_is_started_again(cluster: Cluster) -> None:
    first = 'sys.argv[1] == "router" and open(os.environ["NOTES"]).read().count("router") == 1'
    cluster.command("hoz-dist", NOTE + f"if {first}: os.kill(os.getpid(), 9)\n")
    cluster.run(RUN)
    assert [words[0] for words in cluster.called("hoz-dist")].count("router") == 2


@pytest.mark.parametrize("words", [(), ("--scene", "kitchen")], ids=["all", "kitchens"])
@pytest.mark.parametrize("keys", [{}, {"HOZ_KEYS": "/keys"}], ids=["plain", "keys"])
def test_each_task_is_one_actor_until_the_run_is_over(
    cluster: Cluster, keys: Mapping[str, str], words: tuple[str, ...]
) -> None:
    cluster.endpoint.parent.mkdir()
    cluster.endpoint.write_text("tcp/node1:7447\n")
    cluster.run(ACTORS, *words, **keys)
    actor, status = cluster.called("hoz-dist")
    parse(actor)
    parse(status)
    assert option(actor, "--name") == "3"
    assert option(actor, "--connect") == option(status, "--connect") == "tcp/node1:7447"
    assert not keys or option(actor, "--keys") == option(status, "--keys") == "/keys/actor-3"
    assert actor.count("--scene") == (1 if words else 4)


def wait_for(check: Callable[[], bool], process: subprocess.Popen[bytes]) -> None:
    until(lambda: check() or process.poll() is not None, "the job")
    assert check()


def test_an_actor_follows_the_run_to_another_node(cluster: Cluster) -> None:
    cluster.command("hoz-dist", NOTE + "if sys.argv[1] != 'actor': sys.exit(1)\n" + STAYS)
    cluster.endpoint.parent.mkdir()
    cluster.endpoint.write_text("tcp/node1:7447\n")
    job = cluster.start(ACTORS)
    wait_for(lambda: len(cluster.called("hoz-dist")) == 1, job)
    cluster.endpoint.write_text("tcp/node2:7447\n")

    def moved() -> bool:
        actors = [words for words in cluster.called("hoz-dist") if words[0] == "actor"]
        return bool(actors) and option(actors[-1], "--connect") == "tcp/node2:7447"

    wait_for(moved, job)
    cluster.command("hoz-dist", NOTE + OVER)
    cluster.endpoint.write_text("tcp/node3:7447\n")
    assert job.wait(20) == 0


ENDS = pytest.mark.parametrize(("state", "again"), [("R", True), ("CG", False)], ids=["time is over", "cancelled"])
"""How a job gets SIGTERM: the state that Slurm then tells, and whether it is to be started again."""


@ENDS
def test_an_actor_that_is_stopped_asks_to_be_started_again_unless_it_was_cancelled(
    cluster: Cluster, state: str, again: bool
) -> None:
    cluster.command("squeue", f"#!/bin/sh\necho {state}\n")
    cluster.command("hoz-dist", NOTE + STAYS)
    cluster.endpoint.parent.mkdir()
    cluster.endpoint.write_text("tcp/node1:7447\n")
    job = cluster.start(ACTORS)
    wait_for(lambda: len(cluster.called("hoz-dist")) == 1, job)
    job.send_signal(signal.SIGTERM)
    job.wait(20)
    assert cluster.called("scontrol") == ([["requeue", "8_3"]] if again else [])
    assert len(cluster.called("hoz-dist")) == 1


@ENDS
def test_a_run_that_is_stopped_stops_its_steps_first(cluster: Cluster, state: str, again: bool) -> None:
    note_pid = "open(os.environ['NOTES'] + '.' + str(os.getpid()), 'w').close()\n"
    stop_all = (
        "import glob, signal\n"
        "for path in glob.glob(os.environ['NOTES'] + '.*'): os.kill(int(path.rpartition('.')[2]), signal.SIGTERM)\n"
    )
    cluster.command("squeue", f"#!/bin/sh\necho {state}\n")
    cluster.command("hoz-dist", NOTE + STAYS.replace("while", note_pid + "while"))
    cluster.command("scancel", NOTE + stop_all)
    job = cluster.start(RUN)
    wait_for(lambda: len(list(cluster.folder.glob("notes.*"))) == 3, job)
    job.send_signal(signal.SIGTERM)
    job.wait(20)
    assert cluster.called("scancel") == [["--signal=TERM", "7"]]
    assert cluster.called("scontrol") == ([["requeue", "7"]] if again else [])
    # Nothing was started again meanwhile.
    assert len(cluster.called("hoz-dist")) == 3
