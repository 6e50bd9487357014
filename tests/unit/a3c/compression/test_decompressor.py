import numpy as np
import pytest

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.a3c.compression.decompressor import Decompressor
from hoz_dist.config import Compression
from hoz_dist.gradient_forms import Bf16Gradient, Int8Gradient, TopKGradient
from tests.unit.a3c.compression.making import LATE, NO_BOUND, vector

PIECES = 150_001
"""More entries than a piece has, and a last block that is a short one."""


def test_numbers_are_those_that_the_protocol_says() -> None:
    decompressor = Decompressor(300)
    halves = np.full(300, 0x3F80, np.uint16)
    halves[1] = 0xC000
    expected = np.ones(300)
    expected[1] = -2.0
    np.testing.assert_array_equal(decompressor.decompress(Bf16Gradient(halves)).vector, expected)

    levels = np.arange(300).astype(np.int8)
    scales = np.array([0.5, 2.0], np.float32)
    np.testing.assert_array_equal(
        decompressor.decompress(Int8Gradient(levels, scales)).vector, levels * np.where(np.arange(300) < 256, 0.5, 2.0)
    )

    expected = np.zeros(300)
    expected[[7, 299]] = 1.0, -2.0
    largest = TopKGradient(300, np.array([7, 299], np.uint32), halves[:2])
    np.testing.assert_array_equal(decompressor.decompress(largest).vector, expected)


def test_what_was_received_may_be_read_only_and_stays_as_it_is() -> None:
    bits = np.frombuffer(b"\x80\x3f\x00\xc0", np.uint16)
    found = Decompressor(2).decompress(Bf16Gradient(bits)).vector
    found[:] = 7.0
    np.testing.assert_array_equal(bits, [0x3F80, 0xC000])


@pytest.mark.parametrize("codec", ["fp32", "bf16", "int8", "topk"])
@pytest.mark.parametrize("weight", [1.0, 0.5, 0.7])
def test_entries_are_weighted_and_the_norm_is_that_of_the_gradient(codec: Compression, weight: float) -> None:
    decompressor = Decompressor(PIECES)
    decompressor.decompress(Bf16Gradient(np.full(PIECES, 0x3F80, np.uint16)))  # nothing of it may stay
    gradient = Compressor(codec, PIECES, NO_BOUND).compress(vector(0, PIECES, norm=3.0), LATE)
    alone = Decompressor(PIECES).decompress(gradient).vector
    found, norm = decompressor.decompress(gradient, weight)
    np.testing.assert_allclose(found, alone * weight, rtol=1e-6)
    assert norm == pytest.approx(np.linalg.norm(alone.astype(np.float64)), rel=2e-6)
