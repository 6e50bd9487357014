import re
from pathlib import Path

import pytest

from tests.unit.deploy.reading import DEPLOY, ROOT

# Key folders of whoever deploys from this checkout are no part of it.
FILES = [path for path in DEPLOY.rglob("*") if path.is_file() and "keys" not in path.parts]
DOCUMENTS = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]


@pytest.mark.parametrize("path", [*FILES, *DOCUMENTS], ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_holds_a_key_or_names_a_package_index(path: Path) -> None:
    text = path.read_text()
    assert "PRIVATE KEY" not in text
    assert not re.search(r"pypi\.|pythonhosted|debian\.org|index-url[ =]h|whl/cpu", text)


def test_key_folders_are_ignored_by_git_and_docker() -> None:
    assert "keys/" in (ROOT / ".gitignore").read_text().splitlines()
    # Nothing but what is named goes to the builder.
    assert (ROOT / ".dockerignore").read_text().splitlines()[1] == "*"
