"""Figures over many analysed episodes, which say where success and SPL are lost; docs/analysis.md explains each."""

import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from hoz_dist.evaluation.episode_analysis import NEVER, Cause, EpisodeAnalysis, Kinds, ZoneUse
from hoz_dist.evaluation.success_by_length import success_by_length
from hoz_dist.nav.metrics import LONG_EPISODE

FAILURES: Final = tuple(cause for cause in Cause if cause is not Cause.SUCCESS)


@dataclass(frozen=True)
class Analysis:
    """The analysed episodes of a method, at least one."""

    name: str
    trials: tuple[tuple[EpisodeAnalysis, ...], ...]
    """One for each trial of each run of the method; all of the same episodes in the same order."""

    @property
    def episodes(self) -> tuple[EpisodeAnalysis, ...]:
        """The episodes of all trials."""
        return tuple(episode for trial in self.trials for episode in trial)

    def where(self, wanted: Callable[[EpisodeAnalysis], bool]) -> "Analysis | None":
        """Return a part of the episodes; None when it is empty.

        Args:
            wanted: Tells by what is the same in every trial, such as L* or the scene.
        """
        trials = tuple(tuple(filter(wanted, trial)) for trial in self.trials)
        return Analysis(self.name, trials) if trials[0] else None

    @property
    def long(self) -> "Analysis | None":
        """The long episodes; None when there are none."""
        return self.where(lambda episode: episode.optimal >= LONG_EPISODE)

    def to_json(self) -> dict[str, Any]:
        """Return all figures."""
        zones = zone_figures(self)
        return {
            "trials": len(self.trials),
            "episodes": len(self.trials[0]),
            "causes": causes(self),
            "spl_budget": asdict(spl_budget(self)),
            "what_if": {name: asdict(rates) for name, rates in what_if(self).items()},
            "phases": asdict(phases(self)),
            "zones": None if zones is None else asdict(zones),
            "success_by_length": [part._asdict() for part in success_by_length(self.trials)],
        }


def causes(analysis: Analysis) -> dict[Cause, float]:
    """Return the share of episodes that ended in each way, percent; together 100."""
    counts = Counter(episode.cause for episode in analysis.episodes)
    return {cause: _percent(counts[cause], counts.total()) for cause in Cause}


@dataclass(frozen=True)
class SplBudget:
    """Where each point of SPL goes, percent of what an agent on shortest paths has; together 100.

    A success in L actions loses 1 - L*/L. Its L - L* actions too many are those of the search, the approach and the
    late Done (`EpisodeAnalysis.search_excess` and the following), and each has its part of the loss.
    """

    spl: float
    search: float
    """Lost by successes before the target was seen."""
    approach: float
    """Lost by successes between then and the first view where Done would succeed."""
    late_done: float
    """Lost by successes after it."""
    failures: dict[Cause, float]
    """Lost by failures, which lose all, by their causes."""


def spl_budget(analysis: Analysis) -> SplBudget:
    """Split what is lacking to an SPL of 100 by where it is lost."""
    episodes = analysis.episodes
    found = [episode for episode in episodes if episode.success]

    def lost(excess: Callable[[EpisodeAnalysis], int]) -> float:
        return _percent(sum(excess(episode) / max(episode.length, 1) for episode in found), len(episodes))

    return SplBudget(
        spl=_percent(sum(episode.spl for episode in episodes), len(episodes)),
        search=lost(lambda episode: episode.search_excess),
        approach=lost(lambda episode: episode.approach_excess),
        late_done=lost(lambda episode: episode.done_excess),
        failures={cause: share for cause, share in causes(analysis).items() if cause in FAILURES},
    )


@dataclass(frozen=True)
class Rates:
    """SR and SPL, percent."""

    sr: float
    spl: float


def what_if(analysis: Analysis) -> dict[str, Rates]:
    """Compute what SR and SPL would be if one part of the agent were perfect, and all else as it was.

    Returns:
        ``as_it_is``; ``search`` and ``approach``: the same successes without that part's excess; ``done``: Done is said
        at the first view where it succeeds; ``after_sight``: a shortest path and Done follow the first sight. The last
        two turn failures into successes too. An episode that never came so far stays a failure, although a better agent
        might have gone on.
    """
    episodes = analysis.episodes

    def rates(lengths: Iterable[tuple[EpisodeAnalysis, int]]) -> Rates:
        all_spl = [episode.spl_with(length) for episode, length in lengths]
        return Rates(_percent(len(all_spl), len(episodes)), _percent(sum(all_spl), len(episodes)))

    found = [episode for episode in episodes if episode.success]
    seen = [episode for episode in episodes if episode.seen_after != NEVER]
    reached = [episode for episode in episodes if episode.reached_after != NEVER]
    return {
        "as_it_is": rates((e, e.length) for e in found),
        "search": rates((e, e.length - e.search_excess) for e in found),
        "approach": rates((e, e.length - e.approach_excess) for e in found),
        "done": rates((e, e.reached_after) for e in reached),
        "after_sight": rates((e, e.seen_after + e.approach_optimal) for e in seen),
    }


@dataclass(frozen=True)
class Phases:
    """Search and approach; means are over episodes, None when there is none of the kind."""

    seen: float
    """Episodes in which the target was seen, percent."""
    search_actions: float | None
    """Mean actions until then, of these."""
    search_optimal: float | None
    """Mean of the least number of actions until it can be seen, of the same."""
    success_when_seen: float | None
    """Of the episodes in which the target was seen, those that succeeded, percent."""
    approach_actions: float | None
    """Mean actions from the first sight to the end, of successes."""
    approach_optimal: float | None
    """Mean L* from the first sight, of successes."""
    done_actions: float | None
    """Mean actions after Done would first have succeeded, of successes; a part of `approach_actions`."""
    actions_after_sight: float
    """Of the actions of all episodes, those after the first sight, percent."""
    revisits: float
    """Of the same, those that led to a view where the agent had been before, percent."""
    search_kinds: dict[str, float]
    """Of the actions before the first sight, those of each of `Kinds`, percent."""
    approach_kinds: dict[str, float]
    """Of those after it."""


def phases(analysis: Analysis) -> Phases:
    """Compare search and approach with the least that is possible."""
    episodes = analysis.episodes
    seen = [episode for episode in episodes if episode.seen_after != NEVER]
    found = [episode for episode in seen if episode.success]
    actions = sum(episode.length for episode in episodes)
    return Phases(
        seen=_percent(len(seen), len(episodes)),
        search_actions=_mean(e.seen_after for e in seen),
        search_optimal=_mean(e.seen_optimal for e in seen),
        success_when_seen=_percent(len(found), len(seen)) if seen else None,
        approach_actions=_mean(e.length - e.seen_after for e in found),
        approach_optimal=_mean(e.approach_optimal for e in found),
        done_actions=_mean(e.done_excess for e in found),
        actions_after_sight=_percent(sum(e.length - e.seen_after for e in seen), actions),
        revisits=_percent(sum(e.revisits for e in episodes), actions),
        search_kinds=_shares(e.search for e in episodes),
        approach_kinds=_shares(e.approach for e in episodes),
    )


@dataclass(frozen=True)
class ZoneFigures:
    """What the graph did, in percent of guided actions if nothing else is said."""

    right_scene: float
    """Guided by the graph of the room's own scene."""
    subgoal_differs: float
    """With a sub-goal other than the target zone."""
    in_target_zone: float
    """With the current zone being the target zone, so that the graph has nothing to say."""
    subgoals: float
    """Sub-goals that were pursued, mean of an episode."""
    reached: float | None
    """Of the sub-goals that were reached or given up for another one, those that were reached."""


def zone_figures(analysis: Analysis) -> ZoneFigures | None:
    """Sum up how zones were used; None for an agent without zones."""
    uses = [episode.zones for episode in analysis.episodes if episode.zones is not None]
    if not uses:
        return None
    total = ZoneUse(*(sum(column) for column in zip(*uses, strict=True)))
    settled = total.subgoals - total.unsettled
    return ZoneFigures(
        right_scene=_percent(total.right_scene, total.steps),
        subgoal_differs=_percent(total.subgoal_differs, total.steps),
        in_target_zone=_percent(total.in_target_zone, total.steps),
        subgoals=total.subgoals / len(uses),
        reached=_percent(total.reached, settled) if settled else None,
    )


def _shares(kinds: Iterable[Kinds]) -> dict[str, float]:
    total: Mapping[str, int] = Kinds(*(sum(column) for column in zip(*kinds, strict=True)))._asdict()
    return {kind: _percent(count, sum(total.values())) for kind, count in total.items()}


def _mean(values: Iterable[float]) -> float | None:
    known = list(values)
    return statistics.fmean(known) if known else None


def _percent(part: float, whole: float) -> float:
    """Return a share in percent; 0 of nothing."""
    return 100.0 * part / whole if whole else 0.0
