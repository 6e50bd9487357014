"""Outcomes and tables for tests."""

from dataclasses import replace

import numpy as np

from hoz_dist.reproduce.budget import Budget
from hoz_dist.reproduce.job import Job
from hoz_dist.reproduce.outcome import Outcome
from hoz_dist.reproduce.row import Row, Table

TINY = Budget(name="tiny", room_frames=1000, apartment_frames=2000, seeds=1, more_seeds=3, trials=2, test_episodes=8)
TABLE = Table(
    name="some",
    title="Some rows",
    references=("hoz",),
    scenes=("bathroom/7", "bathroom/10"),
    rows=(
        Row(name="random", agent="random"),
        Row(name="object", agent="object"),
        Row(name="other order", agent="hoz", more_seeds=True, tested_with={"merge_order": 4}),
        Row(name="hoz", agent="hoz", more_seeds=True),
    ),
)


def outcome_of(job: Job, skill: float = 0.6, seconds: float = 60.0) -> Outcome:
    """What a job may leave; its training took this long."""
    outcome = make_outcome(job.seed, job.protocol.trials, skill=skill)
    facts = {**outcome.facts, "agent": job.agent}
    if job.training is not None:
        facts |= {"config": job.test_config.to_json(), "training_seconds": seconds}
    return replace(outcome, facts=facts)


def make_outcome(seed: int = 0, trials: int = 3, episodes: int = 80, skill: float = 0.6) -> Outcome:
    """Results of an agent that succeeds with a probability, on episodes that are always the same."""
    fixed, rng = np.random.default_rng(0), np.random.default_rng([1, seed])
    optimal = fixed.integers(1, 12, episodes)
    success = rng.random((trials, episodes)) < skill
    actions = optimal + rng.integers(1, 20, (trials, episodes))
    return Outcome(
        rooms=("kitchen/26", "bathroom/27"),
        room=np.arange(episodes) % 2,
        target=fixed.integers(0, 22, episodes),
        optimal=optimal,
        success=success,
        actions=actions,
        moves=rng.integers(0, actions),
        said_done=success | (rng.random((trials, episodes)) < 0.5),
        facts={"agent": "hoz", "test_seconds": 3.0, "training_seconds": 60.0, "choice": {"seconds": 1.0}},
    )
