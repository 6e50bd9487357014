"""Gradients of rollouts, on and off the policy that acted."""

import torch

from hoz_dist.a3c.differentiation import clip_norm


def test_clipping_scales_only_what_is_too_long() -> None:
    long, short = torch.tensor([3.0, 4.0]), torch.tensor([0.3, 0.4])
    clip_norm(long, 1.0)
    clip_norm(short, 1.0)
    torch.testing.assert_close(long, torch.tensor([0.6, 0.8]))
    torch.testing.assert_close(short, torch.tensor([0.3, 0.4]))
