import pytest

from hoz_dist.cli.learner import _config
from hoz_dist.cli.main import run
from hoz_dist.config import RunConfig


@pytest.mark.parametrize(
    ("preset", "given", "expected"), [("compact", None, 1e-3), ("paper", None, 1e-4), ("paper", 0.5, 0.5)]
)
def test_the_learning_rate_is_the_presets_unless_given(preset: str, given: float | None, expected: float) -> None:
    assert _config(None, given, {"preset": preset}).learning_rate == expected


def test_without_options_the_configuration_is_the_default_one() -> None:
    assert _config(None, None, {}) == RunConfig()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--model", "magic"], "Unknown method 'magic'"),
        (["--zones", "1"], "'zones' is 1"),
        (["--minutes", "1", "--frames", "2"], "either minutes or frames"),
        (["--encoder", "resnet18"], "--weights"),
    ],
)
def test_a_wrong_option_is_said_in_one_sentence(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["learner", *options]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert len(error.strip().splitlines()) == 1
