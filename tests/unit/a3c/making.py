"""Rollouts made by hand."""

import torch

from hoz_dist.a3c.rollout import Rollout


def make_rollout(*, steps: int, batch: int, seed: int, ends: bool = True) -> Rollout:
    """Make a rollout of random numbers with NEXT_STEP autoreset; without ``ends``, no episode ends in it."""
    generator = torch.Generator().manual_seed(seed)
    ending = torch.zeros(steps, batch, dtype=torch.bool)
    valid = torch.ones(steps, batch, dtype=torch.bool)
    if ends:
        ending = torch.rand(steps, batch, generator=generator) < 0.3
        for t in range(1, steps):
            valid[t] = ~(ending[t - 1] & valid[t - 1])
        ending &= valid
    by_itself = torch.rand(steps, batch, generator=generator) < 0.5
    return Rollout(
        actions=torch.randint(6, (steps, batch), generator=generator),
        rewards=torch.randn(steps, batch, generator=generator) * valid,
        terminated=ending & by_itself,
        truncated=ending & ~by_itself,
        valid=valid,
        values=torch.randn(steps, batch, generator=generator),
        bootstrap=torch.randn(batch, generator=generator),
    )
