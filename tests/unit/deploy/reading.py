"""Reads what deploys hoz-dist, and parses command lines as `hoz-dist` does."""

import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

import click
import yaml

from hoz_dist.cli.main import cli
from hoz_dist.wire.transport.environment import child_environment

ROOT = Path(__file__).parents[3]
DEPLOY = ROOT / "deploy"


def parse(words: Sequence[str]) -> None:
    """Parse the words after `hoz-dist` without running the command.

    Raises:
        click.UsageError: There is no such option, or a value is of another type.
        UnknownNameError: There is no such command.
    """
    command: click.Command = cli
    context = click.Context(cli, info_name="hoz-dist")
    rest = list(words)
    while isinstance(command, click.Group):
        if not rest or rest[0] in {"--help", "--version"}:
            return  # it says what there is
        name, found, rest = command.resolve_command(context, rest)
        assert found is not None
        command, context = found, click.Context(found, context, info_name=name)
    if "--help" not in rest:
        command.make_context(context.info_name, rest, parent=context.parent)


def commands_in(script: str) -> Iterator[list[str]]:
    """Find what a shell script calls `hoz-dist` with, one line or continued ones each."""
    for line in script.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
        lexer.whitespace_split = True
        words: list[str] | None = None
        for word in lexer:
            if set(word) <= set(";&|<>()"):
                if words:
                    yield words
                words = None
            elif words is not None:
                words.append(word)
            elif word == "hoz-dist" or word.endswith("bin/hoz-dist"):
                words = []
        if words:
            yield words


def filled_in(words: Sequence[str], values: Mapping[str, str]) -> list[str]:
    """Put values in the place of ``$(NAME)``, ``${NAME}`` and ``$NAME``, longer names first."""
    filled = []
    for word in words:
        for name in sorted(values, key=len, reverse=True):
            for reference in (f"$({name})", f"${{{name}}}", f"${name}"):
                word = word.replace(reference, values[name])  # noqa: PLW2901 - grows into its final form
        filled.append(word)
    return filled


def process_settings() -> dict[str, str]:
    """Return what every process must find in its environment."""
    with patch.dict(os.environ, clear=True):
        return child_environment()


def environment_file(path: Path) -> dict[str, str]:
    """Read a file of ``NAME=value`` lines as systemd and a shell do."""
    lines = [line for line in path.read_text().splitlines() if line and not line.startswith("#")]
    return {name: value.strip('"') for name, _, value in (line.partition("=") for line in lines)}


class _ComposeLoader(yaml.SafeLoader):
    """Knows the tag by which a compose file replaces a list instead of adding to it."""


_ComposeLoader.add_constructor(
    "!override",
    lambda loader, node: loader.construct_sequence(node, deep=True),  # type: ignore[arg-type]
)


def compose_file(name: str) -> dict[str, Any]:
    """Read a compose file."""
    content: dict[str, Any] = yaml.load((DEPLOY / name).read_text(), _ComposeLoader)  # noqa: S506 - a safe loader
    return content
