import numpy as np

from hoz_dist.a3c.compression.decompressor import Decompressor
from hoz_dist.gradient_forms import Bf16Gradient, Int8Gradient, TopKGradient


def test_numbers_are_those_that_the_protocol_says() -> None:
    decompressor = Decompressor(300)
    halves = np.full(300, 0x3F80, np.uint16)
    halves[1] = 0xC000
    expected = np.ones(300)
    expected[1] = -2.0
    np.testing.assert_array_equal(decompressor.vector(Bf16Gradient(halves)), expected)

    levels = np.arange(300).astype(np.int8)
    scales = np.array([0.5, 2.0], np.float32)
    np.testing.assert_array_equal(
        decompressor.vector(Int8Gradient(levels, scales)), levels * np.where(np.arange(300) < 256, 0.5, 2.0)
    )

    expected = np.zeros(300)
    expected[[7, 299]] = 1.0, -2.0
    largest = TopKGradient(300, np.array([7, 299], np.uint32), halves[:2])
    np.testing.assert_array_equal(decompressor.vector(largest), expected)


def test_what_was_received_may_be_read_only_and_stays_as_it_is() -> None:
    bits = np.frombuffer(b"\x80\x3f\x00\xc0", np.uint16)
    found = Decompressor(2).vector(Bf16Gradient(bits))
    found[:] = 7.0
    np.testing.assert_array_equal(bits, [0x3F80, 0xC000])
