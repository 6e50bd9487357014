"""Traces: which views an episode visited, what was done there, and which zones guided the agent."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hoz_dist.evaluation.agents import Agent, ZonePlan
from hoz_dist.evaluation.trials import play
from hoz_dist.nav.episode import Episode, EpisodeResult
from hoz_dist.sim.episode_runner import EpisodeRunner
from hoz_dist.sim.room_views import RoomViews


@runtime_checkable
class Guided(Protocol):
    """An agent that can say which zones guided it."""

    def zone_plan(self) -> ZonePlan | None:
        """Return what guided the last actions, [B]; None when there are no zones."""
        ...


class EpisodeTrace(NamedTuple):
    """One episode from its start to its end, in A actions."""

    result: EpisodeResult
    views: NDArray[np.int32]
    """Views that were visited, the start first, [A + 1]; nothing is decided any more at the last one."""
    actions: NDArray[np.int8]
    """What was done at each view but the last, [A]."""
    plan: ZonePlan | None
    """What guided each action, int16 [A]; None for an agent without zones."""


def trace_episodes(
    agent: Agent,
    rooms: Sequence[RoomViews],
    episodes: Sequence[Episode],
    seed: int,
    progress: Callable[[int], None] | None = None,
) -> list[EpisodeTrace]:
    """Run an agent over episodes once, as a trial of `run_trials` with that seed does, and note every step.

    Args:
        agent: Who acts.
        rooms: The rooms of the episodes.
        episodes: What to run.
        seed: Seed of the actions.
        progress: Called with the number of episodes that have ended.

    Returns:
        A trace of each episode, in the order of the list.
    """
    actions: list[NDArray[np.int8]] = []
    plans: list[NDArray[np.int16]] = []
    runner = EpisodeRunner(rooms, episodes)
    for taken in play(agent, runner, seed):
        actions.append(taken.astype(np.int8))
        plan = agent.zone_plan() if isinstance(agent, Guided) else None
        if plan is not None:
            plans.append(np.stack(plan).astype(np.int16))
        if progress is not None:
            progress(int((~runner.active).sum()))
    all_actions, all_plans = np.stack(actions), np.stack(plans) if plans else None

    def trace(slot: int, result: EpisodeResult, way: NDArray[np.int64]) -> EpisodeTrace:
        steps = result.actions
        plan = None if all_plans is None else ZonePlan(*(part.copy() for part in all_plans[:steps, :, slot].T))
        return EpisodeTrace(result, way.astype(np.int32), all_actions[:steps, slot].copy(), plan)

    ended = zip(runner.results(), runner.trajectories(), strict=True)
    return [trace(slot, result, way) for slot, (result, way) in enumerate(ended)]
