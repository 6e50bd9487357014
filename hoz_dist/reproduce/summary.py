"""What the outcomes of a table's rows say: means, deviations, and differences with intervals; no input or output."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.evaluation.success_by_length import LENGTHS
from hoz_dist.reproduce.bootstrap import Interval, Resampling
from hoz_dist.reproduce.outcome import METRICS, Outcome
from hoz_dist.reproduce.row import BASELINES, Row

_FEWEST_IN_GROUP: Final = 20
"""Episodes of a group; what fewer of them say is one or two rooms', not a scene's or a length's."""


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviations of a metric, percent."""

    mean: float
    of_trials: float
    """Over the trials of all seeds, as the paper reports it: drawing actions and, with several seeds, training."""
    of_seeds: float | None
    """Over the means of the seeds, which is what another training would differ by; None for one seed."""

    @property
    def deviation(self) -> float:
        """The deviation over seeds; of one seed, that over its trials."""
        return self.of_trials if self.of_seeds is None else self.of_seeds

    def to_json(self) -> dict[str, float | None]:
        """Return JSON values, percent."""
        return {
            "mean": _rounded(self.mean),
            "deviation": _rounded(self.deviation),
            "std_of_trials": _rounded(self.of_trials),
            "std_of_seeds": _rounded(self.of_seeds),
        }


@dataclass(frozen=True)
class RowSummary:
    """What is known of a row."""

    seeds: tuple[int, ...]
    trials: int
    episodes: Mapping[str, int]
    """Number of episodes of a trial, by part (all of them, and the long ones, which have L* >= 5) and by group."""
    spreads: Mapping[str, Mapping[str, Spread]]
    """By part and metric."""
    differences: Mapping[str, Mapping[str, Mapping[str, Interval]]]
    """Row - reference, percent points, by reference, part and metric; empty when there is nothing to compare with."""
    where: Mapping[str, Mapping[str, Interval]]
    """Row - first reference, percent points, by group of episodes (scene, range of L*) and metric; no small groups."""
    by_scene: Mapping[str, Mapping[str, float]]
    """Means of all episodes, percent, by scene and metric."""

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, percent."""
        return {
            "seeds": list(self.seeds),
            "trials": self.trials,
            "episodes": dict(self.episodes),
            **{part: {name: one.to_json() for name, one in self.spreads[part].items()} for part in self.spreads},
            "differences": {reference: _of_parts(parts) for reference, parts in self.differences.items()},
            "where": _of_parts(self.where),
            "scenes": {
                scene: {name: _rounded(value) for name, value in values.items()}
                for scene, values in self.by_scene.items()
            },
        }


def summarise(
    outcomes: Mapping[str, Mapping[int, Outcome]],
    references: Sequence[str],
    agents: Mapping[str, Hashable] | None = None,
) -> dict[str, RowSummary]:
    """Summarise the rows of a table.

    Args:
        outcomes: By row and seed; all of the same episodes, of each row equally many trials.
        references: Rows that all others are compared with; those without outcomes are left out.
        agents: What tells each row's agents from others. Rows with the same are the same agents, tested otherwise, so
            that their seeds are compared one by one; all others, and all if None, are compared by their means.

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
    parts = _Comparison.of({part: mask for part, mask in masks.items() if mask.any()}, first)
    groups = _Comparison.of(_groups(first), first)
    summaries = {}
    for name, by_seed in present.items():
        values = _values(by_seed)
        differences: dict[str, dict[str, dict[str, Interval]]] = {}
        where: dict[str, dict[str, Interval]] = {}
        for reference in references:
            if reference == name or reference not in present:
                continue
            same = agents is not None and agents[name] == agents[reference]
            same_seeds = same and tuple(by_seed) == tuple(present[reference])
            theirs = _values(present[reference])
            differences[reference] = parts.intervals(values, theirs, same_seeds=same_seeds)
            if reference == references[0]:
                where = groups.intervals(values, theirs, same_seeds=same_seeds)
        summaries[name] = RowSummary(
            seeds=tuple(by_seed),
            trials=len(next(iter(by_seed.values())).success),
            episodes={name: int(mask.sum()) for name, mask in (parts.masks | groups.masks).items()},
            spreads={
                part: {metric: _spread(100.0 * values[metric][..., mask].mean(axis=-1)) for metric in METRICS}
                for part, mask in parts.masks.items()
            },
            differences=differences,
            where=where,
            by_scene={
                str(scene): {
                    metric: 100.0 * float(values[metric][..., first.scene == scene].mean()) for metric in METRICS
                }
                for scene in dict.fromkeys(first.scene.tolist())
            },
        )
    return summaries


def of_one_seed(row: Row, reference: str, summaries: Mapping[str, RowSummary]) -> bool:
    """Tell whether a row's intervals against a reference leave out how much another training would differ."""
    trained = [name for name in (row.name, reference) if not (name == row.name and row.agent in BASELINES)]
    return min(len(summaries[name].seeds) for name in trained) == 1


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Compares rows in sets of episodes."""

    masks: dict[str, NDArray[np.bool_]]
    """Which episodes are in each set, [E]."""
    draws: Mapping[str, Resampling]
    """Of each set."""

    @classmethod
    def of(cls, masks: dict[str, NDArray[np.bool_]], first: Outcome) -> "_Comparison":
        """Draw once for all comparisons of some sets."""
        return cls(masks, {name: Resampling(first.room[mask], first.scene[mask]) for name, mask in masks.items()})

    def intervals(
        self, row: Mapping[str, NDArray[np.float64]], reference: Mapping[str, NDArray[np.float64]], *, same_seeds: bool
    ) -> dict[str, dict[str, Interval]]:
        """Return row - reference, percent points, by set and metric, of what each episode counts, [S, T, E]."""
        return {
            name: {
                metric: self.draws[name].interval(
                    100.0 * row[metric][..., mask].mean(axis=1),
                    100.0 * reference[metric][..., mask].mean(axis=1),
                    same_seeds=same_seeds,
                )
                for metric in METRICS
            }
            for name, mask in self.masks.items()
        }


def _groups(first: Outcome) -> dict[str, NDArray[np.bool_]]:
    """Return the groups of episodes in which rows are compared: scenes, if there are several, and ranges of L*."""
    scenes = dict.fromkeys(first.scene.tolist())
    groups = {str(scene): first.scene == scene for scene in scenes} if len(scenes) > 1 else {}
    for least, following in zip(LENGTHS, (*LENGTHS[1:], None), strict=True):
        name = f"L* {least}+" if following is None else f"L* {least}-{following - 1}"
        groups[name] = (first.optimal >= least) & (True if following is None else first.optimal < following)
    return {name: mask for name, mask in groups.items() if mask.sum() >= _FEWEST_IN_GROUP}


def _values(by_seed: Mapping[int, Outcome]) -> dict[str, NDArray[np.float64]]:
    """Return what each episode counts, by metric, [S, T, E]."""
    return {metric: np.stack([outcome.values(metric) for outcome in by_seed.values()]) for metric in METRICS}


def _spread(means: NDArray[np.float64]) -> Spread:
    """Summarise the means of trials, percent, [S, T]."""
    return Spread(
        mean=float(means.mean()),
        of_trials=float(means.std(ddof=1)) if means.size > 1 else 0.0,
        of_seeds=float(means.mean(axis=1).std(ddof=1)) if len(means) > 1 else None,
    )


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)


def _of_parts(parts: Mapping[str, Mapping[str, Interval]]) -> dict[str, dict[str, dict[str, float | None]]]:
    """Return intervals by part and metric as JSON values."""
    return {
        part: {
            metric: {name: _rounded(value) for name, value in interval._asdict().items()}
            for metric, interval in of_part.items()
        }
        for part, of_part in parts.items()
    }
