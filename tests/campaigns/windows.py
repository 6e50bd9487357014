"""When there was no leader, and what became of the graph queries at the other times.

There is a leader while the observer, a client of the router, holds the token of a learner that is neither killed nor
paused, over a router that is neither. All other times are windows without a leader. A window is excused if a fault of
a learner or of the router brought it about: it begins while that lasts or within `AFTER_S` of its end. Queries count
unless they were sent in an excused window, or at most `LONGEST_S` before one: they could not have been answered.
"""

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from tests.campaigns.faults import Fault

AFTER_S: Final = 1.0
"""A process that wakes up finds its links closed, so its token may go only then."""
LONGEST_S: Final = 0.25
"""An answer that takes longer is too late."""


class Question(NamedTuple):
    """A graph query."""

    sent: float
    seconds: float
    """How long the answer, or its absence, took."""
    answered: bool


class Leaders(NamedTuple):
    """The learners whose tokens the observer held from a time on: name and incarnation of each."""

    time: float
    tokens: frozenset[tuple[str, int]]


class StatusNote(NamedTuple):
    """What the learner said of itself."""

    sent: float
    epoch: int
    version: int
    rejected: dict[str, int]
    duplicates: int


@dataclass(frozen=True)
class Notes:
    """What the prober wrote down."""

    questions: list[Question]
    leaders: list[Leaders]
    statuses: list[StatusNote]


def read_notes(path: Path) -> Notes:
    """Read the prober's file; the last line may be unfinished."""
    notes = Notes([], [], [])
    for line in path.read_text(encoding="utf-8").splitlines(keepends=True):
        if not line.endswith("\n"):
            break
        values: dict[str, Any] = json.loads(line)
        match values.pop("what"):
            case "graph":
                notes.questions.append(Question(**values))
            case "status":
                notes.statuses.append(StatusNote(**values))
            case "leaders":
                tokens = frozenset((str(name), int(incarnation)) for name, incarnation in values["leaders"])
                notes.leaders.append(Leaders(values["time"], tokens))
    notes.questions.sort()
    return notes


class Window(NamedTuple):
    """A time without a leader."""

    began: float
    ended: float
    fault: Fault | None
    """What brought it about; None when nothing excuses it."""

    @property
    def seconds(self) -> float:
        """How long it lasted."""
        return self.ended - self.began


def windows_without_leader(
    leaders: Sequence[Leaders], faults: Sequence[Fault], *, router: str, learners: Collection[str], end: float
) -> list[Window]:
    """Return the times without a leader, from the first leader on.

    Args:
        leaders: What the observer saw.
        faults: What was done.
        router: Name of the router's program.
        learners: Names of the learners' programs, which are the ids of their tokens.
        end: When to stop looking.
    """
    faults = [fault for fault in faults if fault.name == router or fault.name in learners]
    moments = sorted({*(note.time for note in leaders), *(f.began for f in faults), *(f.ended for f in faults), end})
    windows: list[Window] = []
    began: float | None = None
    first = next(note.time for note in leaders if note.tokens)
    for moment in (moment for moment in moments if first <= moment <= end):
        if _leader_at(moment, leaders, faults, router) and moment < end:
            if began is not None:
                windows.append(Window(began, moment, _cause(began, faults)))
            began = None
        elif began is None:
            began = moment
    if began is not None and began < end:
        windows.append(Window(began, end, _cause(began, faults)))
    return windows


def _leader_at(moment: float, leaders: Sequence[Leaders], faults: Sequence[Fault], router: str) -> bool:
    """Tell whether there was a leader from a moment on."""
    paused = {fault.name for fault in faults if fault.kind == "pause" and fault.began <= moment < fault.ended}
    return router not in paused and any(
        name not in paused
        and not _killed_since(_held_since((name, incarnation), moment, leaders), moment, faults, {name, router})
        for name, incarnation in _held_at(moment, leaders)
    )


def _held_at(moment: float, leaders: Sequence[Leaders]) -> frozenset[tuple[str, int]]:
    return next((note.tokens for note in reversed(leaders) if note.time <= moment), frozenset())


def _held_since(token: tuple[str, int], moment: float, leaders: Sequence[Leaders]) -> float:
    """Return when the observer last began to hold a token that it holds at a moment."""
    since = moment
    for note in reversed([note for note in leaders if note.time <= moment]):
        if token not in note.tokens:
            break
        since = note.time
    return since


def _killed_since(since: float, moment: float, faults: Sequence[Fault], names: Collection[str]) -> bool:
    """Tell whether one of some programs was killed after the observer began to hold a token.

    The observer notices it a little later; and a router that comes back makes it hold the tokens anew.
    """
    return any(fault.kind == "kill" and fault.name in names and since <= fault.began <= moment for fault in faults)


def _cause(began: float, faults: Sequence[Fault]) -> Fault | None:
    causes = [fault for fault in faults if fault.began <= began <= fault.ended + AFTER_S]
    return max(causes, key=lambda fault: fault.began, default=None)


@dataclass(frozen=True)
class QueryFigures:
    """How graph queries outside the windows without a leader fared."""

    asked: int
    answered: int
    share: float
    p99_seconds: float
    """99th percentile of the time of the answers."""
    excused: int
    """Queries that were sent in a window."""


def query_figures(questions: Sequence[Question], windows: Sequence[Window]) -> QueryFigures:
    """Return the figures of all queries that count."""
    excused = [window for window in windows if window.fault is not None]
    counted = [
        question
        for question in questions
        if not any(window.began - LONGEST_S <= question.sent < window.ended for window in excused)
    ]
    times = [question.seconds for question in counted if question.answered]
    return QueryFigures(
        asked=len(counted),
        answered=len(times),
        share=len(times) / max(len(counted), 1),
        p99_seconds=float(np.percentile(times, 99)) if times else float("inf"),
        excused=len(questions) - len(counted),
    )
