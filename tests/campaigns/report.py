"""Printing the figures of campaigns."""

import json
import sys
from typing import Any

import click

_LINES: list[str] = []


def keep(name: str, figures: dict[str, Any]) -> None:
    """Keep figures for the end of a test run."""
    _LINES.append(f"{name}: {json.dumps(figures)}")


def kept() -> list[str]:
    """Return the lines that were kept."""
    return _LINES


def show(name: str, figures: dict[str, Any]) -> None:
    """Print figures as JSON; a campaign in which something is wrong or late ends with status 1."""
    click.echo(json.dumps({"campaign": name} | figures, indent=2))
    if figures.get("wrong") or figures.get("late"):
        sys.exit(1)
