"""What users can get wrong: one sentence, exit status 2, and nothing of theirs is touched.

More of it is where the commands are tested: in `test_train`, `test_learner`, `test_evaluate`, `test_view_store` and
`tests/unit/cli`.
"""

from pathlib import Path

import pytest

from hoz_dist.cli.main import run
from hoz_dist.graph.files import save_graph
from tests.integration.commands import SMALL_ROOMS, hoz_dist
from tests.unit.graph.samples import random_scene_graph

pytestmark = pytest.mark.integration

NOBODY = "tcp/127.0.0.1:9"
"""The discard port: nothing listens on it."""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a graph file, a file that only says that it is one, and a folder of the user's."""
    save_graph(random_scene_graph(), tmp_path / "kitchen.json")
    whole = (tmp_path / "kitchen.json").read_bytes()
    (tmp_path / "cut.json").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "notes.mat").write_text("my notes")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("my notes")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes | None]:
    return {str(path): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("train --scene garage", "Unknown scene 'garage'."),
        ("train --scene kitchen/31", "Unknown room 'kitchen/31'"),
        ("train --scene kitchen/25", "Room kitchen/25 is kept for validation; train in kitchen/1 to kitchen/20."),
        ("train --model dqn", "Unknown method 'dqn'. Known: a3c, object, sp, savn, org, org-tpn, hoz, hoz-tpn."),
        ("train --preset huge", "Unknown preset 'huge'."),
        ("train --encoder vit", "Unknown encoder 'vit'."),
        ("train --minutes 1 --frames 1", "A run's budget is either minutes or frames; give one of them."),
        ("train --run kitchen.json", "Invalid value for '--run'"),
        ("train --cache kitchen.json", "Invalid value for '--cache'"),
        ("learner --model dqn", "Unknown method 'dqn'."),
        ("learner --listen 7447", "'7447' is not an endpoint: write protocol/host:port"),
        ("actor --scene garage", "Unknown scene 'garage'."),
        ("actor --scene kitchen/25", "Room kitchen/25 is kept for validation"),
        ("query kitchen --target Microwave", "A plan needs both --target"),
        (f"query kitchen --connect {NOBODY}", f"No learner or router answers at {NOBODY}; start one"),
        (f"status --connect {NOBODY}", f"No learner or router answers at {NOBODY}; start one"),
        ("graph plan kitchen.json --target Unicorn --seen Sink", "Unknown category 'Unicorn'."),
        ("graph plan kitchen.json --target Sink --seen Unicorn", "Unknown category 'Unicorn'."),
        ("graph show none.json", "There is no graph file 'none.json'"),
        ("graph show cut.json", "'cut.json' "),
        ("graph show notes.mat", "'notes.mat' "),
        ("graph convert kitchen.json cut.json", "'cut.json' exists already"),
    ],
)
def test_one_sentence_and_exit_status_2(command: str, said: str, home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    before = contents(home)
    assert run(command.split()) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith(f"hoz-dist: {said}")
    assert err.count("\n") == 1
    assert contents(home) == before


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (f"actor --scene kitchen --connect {NOBODY}", f"No learner or router answers at {NOBODY}; start one"),
        (f"train --run mine --scene {SMALL_ROOMS[0]}", "'mine' holds files but is not a run"),
    ],
)
def test_it_is_the_same_for_commands_that_work_in_processes(command: str, said: str, home: Path) -> None:
    before = contents(home)
    result = hoz_dist(*command.split())
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.startswith(f"hoz-dist: {said}")
    assert result.stderr.count("\n") == 1
    assert contents(home) == before


def test_a_training_whose_actors_fail_ends_with_their_reason(home: Path) -> None:
    command = f"train --run runs/new --scene {SMALL_ROOMS[0]} --actors 1 --cache kitchen.json/views"
    result = hoz_dist(*command.split())
    assert result.returncode == 2
    assert "Traceback" not in result.stderr
    last = result.stderr.splitlines()[-1]
    assert last.startswith("hoz-dist: The actor-0 failed: The view cache kitchen.json/views cannot be written")
