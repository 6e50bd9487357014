import ast
import re
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from hoz_dist.wire.protocol.rejection import Reason
from tests.unit.deploy.reading import ROOT, commands_in, parse

DOCUMENTS = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
OPERATIONS = (ROOT / "docs" / "operations.md").read_text()
ALARMS = re.findall(r"^#+ .*?`(.+…?.*)`", OPERATIONS, re.MULTILINE)
SOURCES = [path for package in ("hoz_dist", "learner", "workers") for path in (ROOT / package).rglob("*.py")]
WARNINGS = {"warning", "exception", "error", "Outage"}
"""Calls that say something to act on."""


def names(paths: list[Path]) -> list[str]:
    return [str(path.relative_to(ROOT)) for path in paths]


# --- commands ---


@pytest.mark.parametrize("document", DOCUMENTS, ids=names(DOCUMENTS))
def test_commands_in_blocks_exist(document: Path) -> None:
    for block in re.findall(r"^```sh\n(.*?)^```", document.read_text(), re.MULTILINE | re.DOTALL):
        for words in commands_in(block):
            parse(words)


@pytest.mark.parametrize("document", DOCUMENTS, ids=names(DOCUMENTS))
def test_commands_that_are_mentioned_exist(document: Path) -> None:
    text = re.sub(r"^```.*?^```", "", document.read_text(), flags=re.MULTILINE | re.DOTALL)
    for mentioned in re.findall(r"`(hoz-dist [^`]*)`", text):
        for words in commands_in(mentioned.replace("\n", " ")):
            try:
                parse([word for word in words if word != "..."])
            except click.NoSuchOption:
                raise
            except click.UsageError:
                continue  # a mention need not say all, and may say N for a number


# --- alarms ---


def text_of(node: ast.expr) -> str | None:
    """Return a string of the source with ``…`` for what varies; None when it is no string."""
    match node:
        case ast.Constant(value=str(text)):
            return re.sub(r"%[-.0-9]*[sdgfr]", "…", text)
        case ast.JoinedStr(values=parts):
            return "".join(part.value if isinstance(part, ast.Constant) else "…" for part in parts)  # type: ignore[misc]
    return None


def strings(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.expr) and (text := text_of(node)) is not None:
            yield " ".join(text.split())


def said(path: Path) -> Iterator[str]:
    """Return what a module logs that somebody should act on."""
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.Call):
            continue
        at_a_level = bool(node.args) and ast.unparse(node.args[0]) == "logging.WARNING"
        if at_a_level or getattr(node.func, "attr", getattr(node.func, "id", "")) in WARNINGS:
            # The first text is what is said; after a logger or a level, it is not the first argument.
            texts = [text for argument in node.args if (text := text_of(argument)) is not None]
            yield from (text for text in texts[:1] if text.strip(" …"))


PROGRAM = [text for path in SOURCES for text in strings(path)]


@pytest.mark.parametrize("alarm", ALARMS)
def test_each_alarm_is_what_the_program_says(alarm: str) -> None:
    # What ends with … is quoted from its beginning only.
    assert any(text == alarm or text.startswith(alarm.rstrip("…")) for text in PROGRAM)


def test_everything_that_is_warned_of_is_explained() -> None:
    warned = {text for path in SOURCES for text in said(path) if "/sim/" not in str(path)}
    assert len(warned) > 10
    assert {text for text in warned if not any(text.startswith(alarm.rstrip("…")) for alarm in ALARMS)} == set()


def test_every_reason_of_a_rejection_is_explained() -> None:
    _, _, table = OPERATIONS.partition("| reason | what it means")
    table = table.partition("\n\n")[0]
    explained = (
        [name for row in table.splitlines() for name in re.findall(r"`(\w+)`", row.split("|")[1])] if table else []
    )
    assert sorted(explained) == sorted(reason.value for reason in Reason)


def test_what_is_to_be_watched_is_there() -> None:
    section = OPERATIONS.partition("## What to watch")[2].partition("\n## ")[0]
    fields = {name for row in section.splitlines() if row.startswith("| `") for name in re.findall(r"`([\w/]+)`", row)}
    scalars = set(re.findall(r"`([\w]+/\w*)`", section))
    assert len(fields) > 10
    assert len(scalars) > 5
    known = set(PROGRAM) | {reason.value for reason in Reason}
    attributes = {
        target.target.id
        for node in ast.walk(ast.parse((ROOT / "hoz_dist" / "wire" / "protocol" / "run_messages.py").read_text()))
        if isinstance(node, ast.ClassDef)
        for target in node.body
        if isinstance(target, ast.AnnAssign) and isinstance(target.target, ast.Name)
    }
    assert {name for name in fields - known - attributes if "/" not in name} == set()
    assert {name for name in scalars if not any(text.startswith(name) for text in PROGRAM)} == set()


# --- links ---


def anchors(document: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", document.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=names(DOCUMENTS))
def test_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)]+)\)", document.read_text()):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        page = (document.parent / path) if path else document
        assert page.exists(), target
        assert not anchor or anchor in anchors(page), target
