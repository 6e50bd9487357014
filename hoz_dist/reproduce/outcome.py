"""What came of every episode of a test, small enough to be kept and published: the statistics need nothing else."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.atomic import replace_file
from hoz_dist.errors import DamagedFileError
from hoz_dist.evaluation.trials import Evaluation
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.metrics import LONG_EPISODE

FORMAT: Final = 1
METRICS: Final = ("sr", "spl", "sae")
_OF_EPISODES: Final = ("room", "target", "optimal")
_OF_TRIALS: Final = ("success", "actions", "moves", "said_done")


@dataclass(frozen=True, eq=False)
class Outcome:
    """Results of T trials of E episodes.

    Raises:
        ValueError: Shapes or values do not fit together.
    """

    rooms: tuple[str, ...]
    """Names of the rooms."""
    room: NDArray[np.int64]
    """Index of each episode's room among them, [E]."""
    target: NDArray[np.int64]
    """Index of each episode's target category, [E]."""
    optimal: NDArray[np.int64]
    """L*, [E]."""
    success: NDArray[np.bool_]
    """[T, E]."""
    actions: NDArray[np.int64]
    """Actions taken, Done included, [T, E]."""
    moves: NDArray[np.int64]
    """MoveAhead actions among them, [T, E]."""
    said_done: NDArray[np.bool_]
    """Whether the agent ended the episode, [T, E]."""
    facts: Mapping[str, Any]
    """What else is worth keeping, as JSON values: configuration, frames, checkpoint, times."""

    def __post_init__(self) -> None:
        """Check what a file may have wrong."""
        episodes, shape = self.optimal.shape, self.success.shape
        if any(getattr(self, name).shape != episodes for name in _OF_EPISODES) or shape[1:] != episodes:
            message = "columns of different lengths"
            raise ValueError(message)
        if 0 in shape or any(getattr(self, name).shape != shape for name in _OF_TRIALS):
            message = "trials of different lengths, or none"
            raise ValueError(message)
        known = (self.room.min() >= 0 and self.room.max() < len(self.rooms)) and (
            self.target.min() >= 0 and self.target.max() < len(TARGETS)
        )
        counts = (self.actions < 1) | (self.moves < 0) | (self.moves > self.actions)
        if not known or self.optimal.min() < 1 or counts.any():
            message = "values out of range"
            raise ValueError(message)

    @classmethod
    def of(cls, evaluation: Evaluation, facts: Mapping[str, Any]) -> "Outcome":
        """Take the results of an evaluation."""
        first = evaluation.trials[0]
        rooms = tuple(dict.fromkeys(str(result.room) for result in first))
        number = {name: index for index, name in enumerate(rooms)}

        def of_trials(name: str) -> NDArray[Any]:
            return np.array([[getattr(result, name) for result in trial] for trial in evaluation.trials])

        return cls(
            rooms=rooms,
            room=np.array([number[str(result.room)] for result in first]),
            target=np.array([result.target for result in first]),
            optimal=np.array([result.optimal for result in first]),
            success=of_trials("success"),
            actions=of_trials("actions"),
            moves=of_trials("moves"),
            said_done=of_trials("said_done"),
            facts=facts,
        )

    @property
    def long(self) -> NDArray[np.bool_]:
        """Whether each episode has L* >= 5, [E]."""
        return self.optimal >= LONG_EPISODE

    @property
    def scene(self) -> NDArray[np.str_]:
        """Scene of each episode, [E]."""
        return np.array([name.partition("/")[0] for name in self.rooms])[self.room]

    def same_episodes(self, other: "Outcome") -> bool:
        """Tell whether another outcome is of the same list of episodes."""
        return self.rooms == other.rooms and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in _OF_EPISODES
        )

    def values(self, metric: str) -> NDArray[np.float64]:
        """Return what each episode counts for a metric, [T, E]; as `hoz_dist.nav.metrics` has it, all at once.

        Args:
            metric: One of `METRICS`.
        """
        success = self.success.astype(np.float64)
        if metric == "spl":
            length = self.actions - self.said_done  # L: actions without Done
            return np.asarray(success * self.optimal / np.maximum(length, self.optimal))
        return np.asarray(success * self.moves / self.actions) if metric == "sae" else success

    def save(self, path: Path) -> None:
        """Write the outcome atomically; its folder is made."""
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(self.to_json(), separators=(",", ":")) + "\n"
        replace_file(path, lambda temporary: temporary.write_text(text, "utf-8"))

    def to_json(self) -> dict[str, Any]:
        """Return JSON values; truth values are strings of 0 and 1, one for each trial."""
        columns: dict[str, Any] = {name: getattr(self, name).tolist() for name in _OF_EPISODES}
        for name in _OF_TRIALS:
            trials = getattr(self, name)
            columns[name] = [_letters(trial) if trial.dtype == np.bool_ else trial.tolist() for trial in trials]
        return {"format": FORMAT, "facts": dict(self.facts), "rooms": list(self.rooms), **columns}

    @classmethod
    def load(cls, path: Path) -> "Outcome":
        """Read what `save` has written.

        Raises:
            DamagedFileError: The file holds something else.
        """
        try:
            values = json.loads(path.read_text("utf-8"))
            if values["format"] != FORMAT:
                message = f"format {values['format']}"
                raise ValueError(message)  # noqa: TRY301 - one handler for all kinds of damage
            if not isinstance(values["facts"], dict):
                message = "facts are no JSON object"
                raise ValueError(message)  # noqa: TRY301, TRY004 - as above
            columns: dict[str, Any] = {
                **{name: _integers(values[name]) for name in (*_OF_EPISODES, "actions", "moves")},
                **{name: np.array([_flags(one) for one in values[name]]) for name in ("success", "said_done")},
            }
            return cls(rooms=tuple(values["rooms"]), facts=values["facts"], **columns)
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
            message = f"'{path}' holds no results of episodes ({error}); delete it, and what it held is done again."
            raise DamagedFileError(message) from error


def _letters(flags: NDArray[np.bool_]) -> str:
    return "".join("1" if flag else "0" for flag in flags)


def _integers(values: object) -> NDArray[np.int64]:
    array = np.array(values)
    if array.dtype != np.int64:  # fractions would be cut off
        message = "numbers that are no integers"
        raise ValueError(message)
    return array


def _flags(letters: str) -> NDArray[np.bool_]:
    if not set(letters) <= {"0", "1"}:
        message = "truth values other than 0 and 1"
        raise ValueError(message)
    return np.array([letter == "1" for letter in letters], dtype=np.bool_)
