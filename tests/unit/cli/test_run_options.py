from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from hoz_dist.cli.main import run
from hoz_dist.cli.run_options import as_arguments, run_config, run_options
from hoz_dist.config import RunConfig
from hoz_dist.policy.relations import SHIPPED, shipped_relations


def choices_of(*words: str) -> dict[str, Any]:
    """Parse words of a command line as a command with the options of a run does."""
    parsed: dict[str, Any] = {}

    @click.command()
    @run_options
    def command(**choices: Any) -> None:
        parsed.update(choices)

    result = CliRunner().invoke(command, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return parsed


@pytest.mark.parametrize(
    ("words", "expected"),
    [((), 1e-3), (("--preset", "paper"), 1e-4), (("--preset", "paper", "--learning-rate", "0.5"), 0.5)],
)
def test_the_learning_rate_is_the_presets_unless_given(words: tuple[str, ...], expected: float) -> None:
    assert run_config(choices_of(*words)).learning_rate == expected


def test_without_options_the_configuration_is_the_default_one() -> None:
    assert run_config(choices_of()) == RunConfig()


def test_options_come_back_from_the_words_that_they_are_written_as() -> None:
    """`train` hands its options on to the learner in this way."""
    words = ("--model", "object", "--without", "scene", "--without", "done", "--zones", "5", "--edge-cost", "product")
    choices = choices_of(*words, "--seed", "3", "--max-lag", "7", "--picture-size", "84")
    assert choices_of(*as_arguments(choices)) == choices
    assert run_config(choices) == RunConfig(
        method="object", without=("scene", "done"), zones=5, edge_cost="product", seed=3, max_lag=7, picture_size=84
    )
    assert as_arguments({"weights": Path("a b"), "cache": None}) == ["--weights", "a b"]


def test_relations_of_a_file_become_part_of_the_configuration(tmp_path: Path) -> None:
    path = tmp_path / "relations.json"
    path.write_text('[["Plate", "near", "Bowl", 3]]')
    choices = choices_of("--model", "sp", "--relations", str(path))
    assert run_config(choices).relations == ("Bowl+Plate",)
    assert choices_of(*as_arguments(choices)) == choices
    assert run_config(choices_of("--model", "sp")).relations == shipped_relations()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--model", "magic"], "Unknown method 'magic'"),
        (["--zones", "1"], "'zones' is 1"),
        (["--minutes", "1", "--frames", "2"], "either minutes or frames"),
        (["--encoder", "resnet18"], "--weights"),
        (["--model", "sp", "--relations", "none.json"], "none.json"),
        (["--relations", str(SHIPPED)], "take 'sp'"),
    ],
)
def test_a_wrong_option_is_said_in_one_sentence(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in ("learner", "train"):
        assert run([command, *options]) == 2
        error = capsys.readouterr().err
        assert words in error
        assert len(error.strip().splitlines()) == 1
