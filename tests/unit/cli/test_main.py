import subprocess
import sys
import time
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec

import click
import pytest

from hoz_dist import __version__
from hoz_dist.cli.main import COMMANDS, cli, run
from hoz_dist.errors import OwnMistakeError
from hoz_dist.evaluation.protocol import TEMPERATURE

HEAVY = {"torch", "numpy", "scipy", "sklearn", "pybullet", "gymnasium", "zenoh", "matplotlib", "rich", "msgpack"}


def every_command(group: click.Group = cli, path: str = "hoz-dist") -> Iterator[tuple[str, click.Command]]:
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        yield f"{path} {name}", command
        if isinstance(command, click.Group):
            yield from every_command(command, f"{path} {name}")


def words_of(path: str) -> list[str]:
    return path.split()[1:]


def help_in_a_fresh_process(*words: str) -> str:
    """Return what `hoz-dist WORDS --help` prints; it may import nothing heavy."""
    code = (
        f"import sys; from hoz_dist.cli.main import run; status = run([*{words!r}, '--help']);"
        f"print('heavy:', sorted({HEAVY!r} & set(sys.modules)), file=sys.stderr); sys.exit(status)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "heavy: []\n")
    return done.stdout


def test_help_lists_every_command_and_imports_nothing_heavy() -> None:
    start = time.perf_counter()
    said = help_in_a_fresh_process()
    elapsed = time.perf_counter() - start
    assert all(f"  {name} " in said for name in COMMANDS)
    assert elapsed < 2.0  # about 0.07 s; the margin is for a busy machine


def test_help_of_evaluate_tells_the_temperature_and_imports_nothing_heavy() -> None:
    assert f"[default: {TEMPERATURE}; 0.01<=x<=10.0]" in " ".join(help_in_a_fresh_process("evaluate").split())


def test_the_table_names_real_commands() -> None:
    for name, entry in COMMANDS.items():
        module, _, attribute = entry.target.partition(":")
        assert find_spec(module), f"{name}: no module {module}"
        command = getattr(import_module(module), attribute)
        assert isinstance(command, click.Command)
        assert command.name == name


def test_every_command_and_option_is_documented() -> None:
    for path, command in every_command():
        assert command.help, f"{path} has no help"
        for parameter in command.params:
            if isinstance(parameter, click.Option):
                assert parameter.help, f"{path} {parameter.opts[0]} has no help"


def test_help_of_every_command_works(capsys: pytest.CaptureFixture[str]) -> None:
    for path, _ in every_command():
        assert run([*words_of(path), "--help"]) == 0
        assert capsys.readouterr().out.startswith(f"Usage: {path} ")


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"hoz-dist, version {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["trian"], "Unknown command 'trian'. Did you mean 'train'?"),
        (["--nonsense"], "No such option '--nonsense'. See 'hoz-dist --help'."),
        (["scenes", "show"], "Missing argument 'ROOM'. See 'hoz-dist scenes show --help'."),
        (["scenes", "show", "garage/1"], "Unknown scene 'garage'."),
        (["scenes", "show", "kitchen/31"], "Unknown room 'kitchen/31': rooms of kitchen are kitchen/1 to kitchen/30."),
        (["scenes", "render", "kitchn"], "Unknown scene 'kitchn'. Did you mean 'kitchen'?"),
        (["scenes", "render", "kitchen", "--split", "all"], "Invalid value for '--split'"),
    ],
)
def test_a_users_mistake_is_one_sentence_and_exit_status_2(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"hoz-dist: {said}")
    assert err.count("\n") == 1


def test_a_bare_command_shows_its_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 2
    assert "Usage: hoz-dist" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (KeyboardInterrupt(), 130, "\n"),  # the shell's prompt then starts a line of its own
        (
            PermissionError(13, "Permission denied", "/nowhere/out.png"),
            2,
            "hoz-dist: '/nowhere/out.png': Permission denied.\n",
        ),
        (OSError(28, "No space left on device"), 2, "hoz-dist: The system refuses: No space left on device.\n"),
        (OSError("cannot write it"), 2, "hoz-dist: The system refuses: cannot write it.\n"),
        (OwnMistakeError("That was us."), 1, "hoz-dist: That was us.\n"),
    ],
)
def test_interruption_and_files_that_cannot_be_used(
    error: BaseException, status: int, said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    @click.command()
    def failing() -> None:
        raise error

    monkeypatch.setattr("hoz_dist.cli.scenes.list_command.callback", failing.callback)
    monkeypatch.setattr("hoz_dist.cli.scenes.list_command.params", [])
    assert run(["scenes", "list"]) == status
    assert capsys.readouterr().err == said


def test_a_reader_that_stops_reading_is_no_error() -> None:
    command = f"{sys.executable} -m hoz_dist.cli.main scenes list --json | head -n 1"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)  # noqa: S607
    assert (done.stdout, done.stderr) == ("{\n", "")
