"""The bound of gradients, which actors keep and the learner checks."""

import numpy as np
import pytest
import torch

from hoz_dist.a3c.compression.codecs import Bf16, Int8
from hoz_dist.a3c.compression.decompressor import Decompressor
from hoz_dist.a3c.norm import clip_norm, gradient_norm
from hoz_dist.gradient_forms import Vector

TRUNK, REST = 13_000, 2_000_000


def like_the_papers(norm: float) -> Vector:
    """A gradient whose first layers hold 95% of its squares, and millions of small entries the rest."""
    rng = np.random.default_rng(0)
    parts = [rng.standard_normal(size) for size in (TRUNK, REST)]
    shares = np.sqrt((0.95, 0.05)) * norm
    return np.concatenate(
        [part * (share / np.linalg.norm(part)) for part, share in zip(parts, shares, strict=True)]
    ).astype(np.float32)


def exact(gradient: Vector) -> float:
    return float(np.linalg.norm(gradient.astype(np.float64)))


def test_small_entries_behind_large_ones_count() -> None:
    gradient = like_the_papers(7.0)
    assert gradient_norm(gradient) == pytest.approx(exact(gradient), rel=2e-6)


def test_what_was_clipped_is_within_the_bound() -> None:
    gradient = torch.from_numpy(like_the_papers(7.0))
    clip_norm(gradient, 1.0)
    assert exact(gradient.numpy()) == pytest.approx(1.0, rel=2e-6)


@pytest.mark.parametrize("codec", [Bf16, Int8])
def test_what_a_codec_sends_is_within_the_bound(codec: type[Bf16 | Int8]) -> None:
    gradient = like_the_papers(7.0)
    sent = codec(gradient.size).take(torch.from_numpy(gradient), 1.0, 0)
    assert exact(Decompressor(gradient.size).decompress(sent).vector) < 1.0 + 2e-6


def test_norm_survives_huge_entries() -> None:
    assert gradient_norm(np.array([3e30, 4e30], dtype=np.float32)) == pytest.approx(5e30, rel=1e-6)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_norm_of_what_is_not_finite_is_not_finite(wrong: float) -> None:
    assert not np.isfinite(gradient_norm(np.array([1.0, wrong], dtype=np.float32)))


def test_clipping_scales_only_what_is_too_long() -> None:
    long, short, huge = torch.tensor([3.0, 4.0]), torch.tensor([0.3, 0.4]), torch.tensor([3e30, 4e30])
    for gradient in (long, short, huge):
        clip_norm(gradient, 1.0)
    torch.testing.assert_close(long, torch.tensor([0.6, 0.8]))
    torch.testing.assert_close(short, torch.tensor([0.3, 0.4]))
    torch.testing.assert_close(huge, torch.tensor([0.6, 0.8]))
