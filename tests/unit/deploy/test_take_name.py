import os
import signal
import subprocess
from pathlib import Path

from tests.unit.deploy.reading import DEPLOY
from tests.waiting import until


def pool(folder: Path, *names: str) -> Path:
    for name in names:
        (folder / f"actor-{name}").mkdir(parents=True)
        # As in a container: the keys can be read, and nothing written.
        (folder / f"actor-{name}").chmod(0o500)
    return folder


class Held:
    """A command under a name, as long as its standard input is open."""

    def __init__(self, names: Path, log: Path) -> None:
        self.log = log
        with log.open("wb") as output:
            self.process = subprocess.Popen(
                [DEPLOY / "take-name", names, "sh", "-c", 'echo "$@"; cat', "sh", "actor"],
                stdin=subprocess.PIPE,
                stdout=output,
            )
        until(lambda: bool(self.words), "a name")

    @property
    def words(self) -> list[str]:
        return self.log.read_text().split()

    def end(self) -> None:
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.communicate()


def test_copies_get_different_names_with_their_keys(tmp_path: Path) -> None:
    names = pool(tmp_path / "keys", "a0", "a1")
    copies = [Held(names, tmp_path / f"{number}.log") for number in range(2)]
    assert copies[0].words == ["actor", "--name", "a0", "--keys", f"{names}/actor-a0"]
    assert copies[1].words == ["actor", "--name", "a1", "--keys", f"{names}/actor-a1"]
    for copy in copies:
        copy.end()


def test_the_name_of_a_killed_copy_is_free_at_once(tmp_path: Path) -> None:
    names = pool(tmp_path / "keys", "a0", "a1")
    first, second = Held(names, tmp_path / "first"), Held(names, tmp_path / "second")
    first.end()
    third = Held(names, tmp_path / "third")
    assert third.words[2] == "a0"
    third.end()
    second.end()


def test_one_copy_too_many_is_told(tmp_path: Path) -> None:
    names = pool(tmp_path / "keys", "a0")
    only = Held(names, tmp_path / "only")
    command: list[str | Path] = [DEPLOY / "take-name", names, "true"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    only.end()
    assert done.returncode == 2
    assert done.stderr == f"take-name: every name in '{names}' is taken; issue more keys, or start fewer copies.\n"


def test_an_empty_pool_has_no_name(tmp_path: Path) -> None:
    assert subprocess.run([DEPLOY / "take-name", tmp_path, "true"], capture_output=True, check=False).returncode == 2
