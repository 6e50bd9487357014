"""What the outcomes of a table's rows say: means, deviations, and differences with intervals; no input or output."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.reproduce.bootstrap import Interval, Resampling
from hoz_dist.reproduce.outcome import METRICS, Outcome


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviations of a metric, percent."""

    mean: float
    of_trials: float
    """Over the trials of all seeds, as the paper reports it: drawing actions and, with several seeds, training."""
    of_seeds: float | None
    """Over the means of the seeds; None for one seed."""

    def to_json(self) -> dict[str, float | None]:
        """Return JSON values, percent."""
        return {"mean": _rounded(self.mean), "std": _rounded(self.of_trials), "std_of_seeds": _rounded(self.of_seeds)}


@dataclass(frozen=True)
class RowSummary:
    """What is known of a row."""

    seeds: tuple[int, ...]
    trials: int
    episodes: Mapping[str, int]
    """Number of episodes of a trial, by part: all of them, and the long ones, which have L* >= 5."""
    spreads: Mapping[str, Mapping[str, Spread]]
    """By part and metric."""
    differences: Mapping[str, Mapping[str, Mapping[str, Interval]]]
    """Row - reference, percent points, by reference, part and metric; empty when there is nothing to compare with."""
    by_scene: Mapping[str, Mapping[str, float]]
    """Means of all episodes, percent, by scene and metric."""

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, percent."""
        return {
            "seeds": list(self.seeds),
            "trials": self.trials,
            "episodes": dict(self.episodes),
            **{part: {name: one.to_json() for name, one in self.spreads[part].items()} for part in self.spreads},
            "differences": {
                reference: {
                    part: {
                        metric: {name: _rounded(value) for name, value in interval._asdict().items()}
                        for metric, interval in of_part.items()
                    }
                    for part, of_part in parts.items()
                }
                for reference, parts in self.differences.items()
            },
            "scenes": {
                scene: {name: _rounded(value) for name, value in values.items()}
                for scene, values in self.by_scene.items()
            },
        }


def summarise(outcomes: Mapping[str, Mapping[int, Outcome]], references: Sequence[str]) -> dict[str, RowSummary]:
    """Summarise the rows of a table.

    Args:
        outcomes: By row and seed; all of the same episodes, of each row equally many trials.
        references: Rows that all others are compared with; those without outcomes are left out.

    Returns:
        By row, in the same order.

    Raises:
        InvalidValueError: Two outcomes are not of the same episodes.
    """
    present = {name: by_seed for name, by_seed in outcomes.items() if by_seed}
    if not present:
        return {}
    first_name, first_seed = next((name, seed) for name, by_seed in present.items() for seed in by_seed)
    first = present[first_name][first_seed]
    for name, by_seed in present.items():
        for seed, one in by_seed.items():
            if not first.same_episodes(one):
                message = (
                    f"The results of '{first_name}' with seed {first_seed} and of '{name}' with seed {seed} are of "
                    "different episodes, so they cannot be compared; delete the older ones, and start again."
                )
                raise InvalidValueError(message)
    masks = {"all": np.ones(len(first.optimal), dtype=np.bool_), "long": first.long}
    masks = {part: mask for part, mask in masks.items() if mask.any()}
    draws = {part: Resampling(first.room[mask], first.scene[mask]) for part, mask in masks.items()}
    summaries = {}
    for name, by_seed in present.items():
        values = {metric: _values(by_seed, metric) for metric in METRICS}
        differences: dict[str, dict[str, dict[str, Interval]]] = {}
        for reference in references:
            if reference == name or reference not in present:
                continue
            same = tuple(by_seed) == tuple(present[reference])
            differences[reference] = {
                part: {
                    metric: draws[part].interval(
                        100.0 * values[metric][..., mask].mean(axis=1),
                        100.0 * _values(present[reference], metric)[..., mask].mean(axis=1),
                        same_seeds=same,
                    )
                    for metric in METRICS
                }
                for part, mask in masks.items()
            }
        summaries[name] = RowSummary(
            seeds=tuple(by_seed),
            trials=len(next(iter(by_seed.values())).success),
            episodes={part: int(mask.sum()) for part, mask in masks.items()},
            spreads={
                part: {metric: _spread(100.0 * values[metric][..., mask].mean(axis=-1)) for metric in METRICS}
                for part, mask in masks.items()
            },
            differences=differences,
            by_scene={
                str(scene): {
                    metric: 100.0 * float(values[metric][..., first.scene == scene].mean()) for metric in METRICS
                }
                for scene in dict.fromkeys(first.scene.tolist())
            },
        )
    return summaries


def _values(by_seed: Mapping[int, Outcome], metric: str) -> NDArray[np.float64]:
    """Return what each episode counts, [S, T, E]."""
    return np.stack([outcome.values(metric) for outcome in by_seed.values()])


def _spread(means: NDArray[np.float64]) -> Spread:
    """Summarise the means of trials, percent, [S, T]."""
    return Spread(
        mean=float(means.mean()),
        of_trials=float(means.std(ddof=1)) if means.size > 1 else 0.0,
        of_seeds=float(means.mean(axis=1).std(ddof=1)) if len(means) > 1 else None,
    )


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)
