"""Error feedback: in the long run the learner sees all of the gradients."""

from typing import get_args

import numpy as np
import pytest

from hoz_dist.a3c.compression.codecs import TOP_SHARE
from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.a3c.compression.decompressor import Decompressor
from hoz_dist.config import Compression
from hoz_dist.gradient_forms import Vector
from hoz_dist.wire.protocol.codec import encode
from hoz_dist.wire.protocol.pushes import GradientPush
from tests.unit.a3c.compression.making import LATE, NO_BOUND, received, vector

LOSSY = tuple(name for name in get_args(Compression) if name != "fp32")
SIZE = 2003


def sums(compression: Compression, gradients: list[Vector], largest: float = NO_BOUND) -> tuple[Vector, Vector]:
    """Return the sum of what is sent of gradients, and their own sum."""
    compressor, decompressor = Compressor(compression, SIZE, largest), Decompressor(SIZE)
    sent = np.zeros(SIZE)
    for gradient in gradients:
        sent += decompressor.decompress(compressor.compress(gradient, LATE)).vector
        compressor.accepted()
    return sent.astype(np.float32), np.stack(gradients).sum(axis=0, dtype=np.float64).astype(np.float32)


@pytest.mark.parametrize(("compression", "error"), [("bf16", 0.004), ("int8", 0.04), ("topk", 12.0)])
def test_what_is_sent_adds_up_to_the_gradients_less_an_error_that_does_not_grow(
    compression: Compression, error: float
) -> None:
    gradients = [vector(seed, SIZE) for seed in range(400)]
    for count in (100, 400):
        sent, wanted = sums(compression, gradients[:count])
        assert 0 < np.linalg.norm(sent - wanted) < error


def test_entries_too_small_for_a_codec_arrive_in_the_end() -> None:
    gradient = np.full(SIZE, 1e-5, np.float32)
    gradient[:3] = 1.0
    sent, wanted = sums("int8", [gradient] * 1000)
    np.testing.assert_allclose(sent[3:256], wanted[3:256], atol=0.008)
    assert wanted[5] == pytest.approx(0.01, rel=1e-3)


def test_every_entry_of_a_gradient_that_never_changes_is_sent_and_the_error_is_bounded() -> None:
    gradient = np.full(SIZE, SIZE**-0.5, np.float32)
    sent, wanted = sums("topk", [gradient] * 1000)
    assert np.linalg.norm(sent - wanted) < 1 / TOP_SHARE
    assert (np.abs(sent - wanted) < 150 * gradient).all()


def test_entries_that_were_cut_off_are_not_the_largest_for_ever() -> None:
    gradient = np.full(SIZE, SIZE**-0.5, np.float32)
    sent, _ = sums("topk", [gradient] * 200, largest=0.1)
    assert (sent > 0).all()


@pytest.mark.parametrize("compression", LOSSY)
def test_a_refused_gradient_leaves_no_trace(compression: Compression) -> None:
    one, other = Compressor(compression, SIZE, NO_BOUND), Compressor(compression, SIZE, NO_BOUND)
    for compressor in (one, other):
        compressor.compress(vector(1, SIZE), LATE)
        compressor.accepted()
    one.compress(vector(2, SIZE), LATE)  # refused
    np.testing.assert_array_equal(
        received(one.compress(vector(3, SIZE), LATE)), received(other.compress(vector(3, SIZE), LATE))
    )


@pytest.mark.parametrize("compression", LOSSY)
def test_the_gradient_of_an_actor_is_left_as_it_is(compression: Compression) -> None:
    gradient = vector(1, SIZE)
    Compressor(compression, SIZE, 0.5).compress(gradient, LATE)
    np.testing.assert_array_equal(gradient, vector(1, SIZE))


def test_a_gradient_in_full_is_itself() -> None:
    gradient = vector(1, SIZE)
    compressor = Compressor("fp32", SIZE, 1.0)
    assert compressor.compress(gradient, LATE) is gradient
    compressor.accepted()
    assert Decompressor(SIZE).decompress(gradient).vector is gradient


@pytest.mark.parametrize(("compression", "times"), [("bf16", 1.99), ("int8", 3.9), ("topk", 30)])
def test_fewer_bytes_travel(compression: Compression, times: float) -> None:
    size = 150_000
    full, short = (
        len(encode(GradientPush("actor-0", 2**48 - 1, 10**6, 3, 10**6, 1280, one)))
        for one in (vector(0, size), Compressor(compression, size, 1.0).compress(vector(0, size), LATE))
    )
    assert full > times * short
