"""What a table compares: rows, and what the paper says of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from hoz_dist.nav.categories import ROOM_SCENES

BASELINES: Final = ("random", "oracle")
"""Agents that are not trained: the floor and the ceiling."""


class Figures(NamedTuple):
    """Results in percent."""

    sr: float
    spl: float
    sae: float


class Paper(NamedTuple):
    """What the paper reports of a row, on AI2-THOR; None where it reports nothing or nobody could read it."""

    all: Figures | None = None
    """Of every episode."""
    long: Figures | None = None
    """Of those with L* >= 5."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One row of a table: a method and how it departs from what all rows have in common."""

    name: str
    agent: str
    """A trained method, or one of `BASELINES`."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Fields of the run's configuration that are not the default ones."""
    tested_with: Mapping[str, Any] = field(default_factory=dict)
    """Fields of the configuration that are changed after the training, for the test alone."""
    more_seeds: bool = False
    """Whether it gets the budget's larger number of seeds: a comparison hangs on it."""
    paper: Paper | None = None
    """None when the paper has no such row."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """One table of the paper, or of ours."""

    name: str
    title: str
    """A sentence's beginning that says what is compared."""
    rows: tuple[Row, ...]
    references: tuple[str, ...]
    """Names of the rows that all others are measured against; the first one also by scene and by L*."""
    scenes: tuple[str, ...] = ROOM_SCENES
    """Scenes or training rooms to train in; the evaluation is in their scenes."""
    alike: bool = False
    """Whether the rows that are no references differ by chance alone, so that their spread is of interest."""
    note: str = ""
    """What a reader has to know: where the rows come from, and what differs from the paper's."""

    @property
    def test_scenes(self) -> tuple[str, ...]:
        """The scenes of the evaluation."""
        return tuple(dict.fromkeys(name.partition("/")[0] for name in self.scenes))
