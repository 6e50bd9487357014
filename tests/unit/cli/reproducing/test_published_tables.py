"""What is published is what the published outcomes of episodes say, to the last figure that is shown."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.main import run

DOCS = Path(__file__).parents[4] / "docs" / "results"
LAST_DIGIT = 0.0101
"""By how much figures of two digits differ that were rounded apart; other processors add in another order."""


@pytest.mark.parametrize(
    ("words", "stem"),
    [
        (["methods"], "methods-quick"),
        (["random-graph"], "random-graph-quick"),
        (["apartments", "--budget", "standard", "--seeds", "5-14"], "apartments-standard-seeds-5-14"),
    ],
)
def test_a_table_is_made_again_of_what_is_published(tmp_path: Path, words: list[str], stem: str) -> None:
    shutil.copytree(DOCS / "results", tmp_path / "results")
    shutil.copy(DOCS / "sessions.json", tmp_path)
    assert run(["reproduce", *words, "--out", str(tmp_path), "--collect"]) == 0
    made, published = (dict(leaves(json.loads((one / f"{stem}.json").read_text()))) for one in (tmp_path, DOCS))
    assert any(path.endswith("/low") for path in published)  # intervals, too
    assert made.keys() == published.keys()
    assert {path: (made[path], value) for path, value in published.items() if not shown_alike(made[path], value)} == {}


def shown_alike(made: Any, published: Any) -> bool:
    if isinstance(made, float) and isinstance(published, float):
        return abs(made - published) <= LAST_DIGIT
    return bool(made == published)


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Everything in JSON values that holds nothing itself, by the names and numbers that lead to it."""
    if not isinstance(value, dict | list) or not value:
        yield path, str(value) if isinstance(value, dict | list) else value
        return
    for name, one in value.items() if isinstance(value, dict) else enumerate(value):
        yield from leaves(one, f"{path}/{name}")
