"""What the learner counts and measures: frames, success, lag, and each actor's part in them."""

from collections import Counter, OrderedDict, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from hoz_dist.a3c.loss import mean_terms

SUCCESS_WINDOW: Final = 1000
"""Episodes over which the success rate is taken."""
LAG_WINDOW: Final = 1000
"""Applied gradients over which the lag is summed up."""
LOSS_WINDOW: Final = 50
"""Rollouts over which the terms of the loss are averaged, in a run that learns from them."""
ACTOR_LAG_WINDOW: Final = 32
"""The same, for one actor."""
RATE_SECONDS: Final = 30
"""Seconds over which frames per second are measured."""
MAX_ACTORS: Final = 4096
"""Actor processes remembered. Of the name that has most of them, the one that was silent longest is forgotten first:
whoever invents incarnations pushes out its own."""


class Rate:
    """Amount per second over the last `RATE_SECONDS`, from one sum per second."""

    def __init__(self) -> None:
        self._first: float | None = None
        self._sums: deque[tuple[int, int]] = deque(maxlen=RATE_SECONDS)

    def add(self, now: float, amount: int) -> None:
        """Count an amount at a time in seconds."""
        self._first = now if self._first is None else self._first
        second = int(now)
        if self._sums and self._sums[-1][0] == second:
            amount += self._sums.pop()[1]
        self._sums.append((second, amount))

    def per_second(self, now: float) -> float:
        """Return the rate at a time in seconds; 0 before anything was counted."""
        if self._first is None:
            return 0.0
        span = min(max(now - self._first, 1.0), float(RATE_SECONDS))
        return sum(amount for second, amount in self._sums if second > now - RATE_SECONDS) / span


class LagSummary(NamedTuple):
    """Policy lag, versions, over recent applied gradients."""

    minimum: int
    mean: float
    maximum: int


@dataclass
class ActorStatistics:
    """What is known of one actor process."""

    rooms: set[str] = field(default_factory=set)
    """Rooms that its episodes and room graphs were of; no more than exist, since no message can name another."""
    frames: int = 0
    """Environment steps of its applied gradients."""
    rate: Rate = field(default_factory=Rate)
    lags: deque[int] = field(default_factory=lambda: deque(maxlen=ACTOR_LAG_WINDOW))
    """Lag of its last applied gradients, versions."""
    last_seen: float = 0.0
    """Time of its last push that counted, seconds."""

    def summary(self, now: float) -> dict[str, Any]:
        """Return all of it as JSON values."""
        return {
            "rooms": sorted(self.rooms),
            "frames": self.frames,
            "frames_per_second": round(self.rate.per_second(now), 1),
            "lag": round(sum(self.lags) / len(self.lags), 2) if self.lags else 0.0,
            "last_seen_seconds": round(max(now - self.last_seen, 0.0), 1),
        }


class Statistics:
    """Counters of a run; those that outlive the process are saved in checkpoints."""

    def __init__(self, frames: int = 0, episodes: int = 0, recent: Iterable[tuple[str, bool]] = ()) -> None:
        self.frames = frames
        """Environment steps whose gradients were applied."""
        self.episodes = episodes
        self.recent: deque[tuple[str, bool]] = deque(recent, maxlen=SUCCESS_WINDOW)
        """(scene, success) of the last episodes."""
        self.losses: dict[str, float] = {}
        """Terms of the loss by name: as an actor last reported them, or means over the last rollouts learnt from."""
        self.duplicates = 0
        """Pushes that were sent again although they had counted, since the process started."""
        self.actors: OrderedDict[tuple[str, int], ActorStatistics] = OrderedDict()
        """By name and incarnation: the speed of a process that left is not that of its successor."""
        self._losses: deque[Mapping[str, float]] = deque(maxlen=LOSS_WINDOW)
        self._lags: deque[int] = deque(maxlen=LAG_WINDOW)
        self._rate = Rate()

    def actor(self, name: str, incarnation: int, now: float) -> ActorStatistics:
        """Return the statistics of an actor process and note that it was heard of now."""
        process = (name, incarnation)
        statistics = self.actors.setdefault(process, ActorStatistics())
        statistics.last_seen = now
        self.actors.move_to_end(process)
        if len(self.actors) > MAX_ACTORS:
            ((most, _),) = Counter(known for known, _ in self.actors).most_common(1)
            del self.actors[next(known for known in self.actors if known[0] == most)]
        return statistics

    def applied(self, actor: str, incarnation: int, frames: int, lag: int, now: float) -> None:
        """Count an applied gradient."""
        self.frames += frames
        self._rate.add(now, frames)
        self._lags.append(lag)
        statistics = self.actor(actor, incarnation, now)
        statistics.frames += frames
        statistics.rate.add(now, frames)
        statistics.lags.append(lag)

    def learnt(self, losses: Mapping[str, float]) -> None:
        """Note the terms of a rollout's loss, which go up and down from one to the next."""
        self._losses.append(losses)
        self.losses = mean_terms(self._losses)

    def finished(self, scene: str, *, success: bool) -> None:
        """Count a finished episode."""
        self.episodes += 1
        self.recent.append((scene, success))

    def frames_per_second(self, now: float) -> float:
        """Return the frames per second of all actors together."""
        return self._rate.per_second(now)

    def lag(self) -> LagSummary:
        """Sum up the lag of recent applied gradients; zeros before the first."""
        if not self._lags:
            return LagSummary(0, 0.0, 0)
        return LagSummary(min(self._lags), sum(self._lags) / len(self._lags), max(self._lags))

    def success(self) -> dict[str, Any]:
        """Return success rates of recent episodes: ``{"episodes", "overall", "scenes": {scene: rate}}``.

        Rates are in [0, 1]; None before the first episode.
        """
        scenes: dict[str, list[bool]] = {}
        for scene, success in self.recent:
            scenes.setdefault(scene, []).append(success)
        return {
            "episodes": len(self.recent),
            "overall": sum(success for _, success in self.recent) / len(self.recent) if self.recent else None,
            "scenes": {scene: sum(outcomes) / len(outcomes) for scene, outcomes in sorted(scenes.items())},
        }
