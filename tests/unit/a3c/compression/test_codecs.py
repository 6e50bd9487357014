"""What each codec sends, against what it should by its definition."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from hoz_dist.a3c.compression.codecs import TOP_SHARE, Bf16, Codec, Int8, TopK, share_at
from hoz_dist.gradient_forms import INT8_BLOCK, Gradient, Vector, blocks_of
from tests.unit.a3c.compression.making import LATE, NO_BOUND, SIZES, left, received, vector

CODECS = (Bf16, Int8, TopK)
VERSIONS = (0, 40, 80, 186, 10**9)


def taken(codec: type[Bf16 | Int8 | TopK], values: Vector, largest: float = NO_BOUND) -> tuple[Gradient, Vector]:
    """Return what a codec sends, and what it leaves."""
    rest = torch.from_numpy(values.copy())
    return codec(values.size).take(rest, largest, LATE), left(rest)


def rounded_to_even(values: Vector) -> NDArray[np.uint16]:
    """Bfloat16 by arithmetic on the bits of float32."""
    bits = values.view(np.uint32).astype(np.uint64)
    return ((bits + 0x7FFF + ((bits >> 16) & 1)) >> 16).astype(np.uint16)


@pytest.mark.parametrize("size", SIZES)
def test_bf16_rounds_to_the_nearest_and_of_two_to_the_even_one(size: int) -> None:
    values = vector(0, size)
    values[: size // 2] = (rounded_to_even(values[: size // 2]).astype(np.uint32) << 16 | 0x8000).view(np.float32)
    sent, rest = taken(Bf16, values)
    np.testing.assert_array_equal(sent.halves, rounded_to_even(values))  # type: ignore[union-attr]
    np.testing.assert_array_equal(received(sent) + rest, values)
    assert (np.abs(rest) <= np.abs(values) * 2.0**-8).all()


@pytest.mark.parametrize("size", SIZES)
def test_int8_is_at_most_half_a_step_off(size: int) -> None:
    values = vector(1, size)
    sent, rest = taken(Int8, values)
    scales = np.repeat(sent.scales, INT8_BLOCK)[:size]  # type: ignore[union-attr]
    assert sent.scales.shape == (blocks_of(size),)  # type: ignore[union-attr]
    np.testing.assert_allclose(received(sent) + rest, values, rtol=1e-6, atol=1e-9)
    assert (np.abs(rest) <= 0.5001 * scales).all()
    for start in range(0, size, INT8_BLOCK):
        largest = np.abs(values[start : start + INT8_BLOCK]).max()
        assert scales[start] == pytest.approx(largest / 127, rel=1e-6)


def test_int8_of_zeros_and_of_the_smallest_numbers_is_finite() -> None:
    values = np.zeros(3 * INT8_BLOCK, np.float32)
    values[INT8_BLOCK : 2 * INT8_BLOCK] = 1e-45
    values[-1] = 1.0
    sent, rest = taken(Int8, values)
    expected = np.zeros_like(values)
    expected[-1] = 1.0
    np.testing.assert_allclose(received(sent), expected, rtol=1e-6)
    np.testing.assert_allclose(received(sent) + rest, values, atol=1e-7)


def uneven(size: int) -> Vector:
    return vector(2, size)


def nothing(size: int) -> Vector:
    return np.zeros(size, np.float32)


def tied(size: int) -> Vector:
    return np.where(np.arange(size) % 3 == 0, 1.0, -1.0).astype(np.float32)


def periodic(size: int) -> Vector:
    """Large only where `TopK` looks, so that it expects more large entries than there are."""
    values = vector(3, size)
    values[np.arange(size) % TopK(size)._stride != 0] *= 1e-6
    return values


def one(size: int) -> Vector:
    values = nothing(size)
    values[size // 2] = 1.0
    return values


@pytest.mark.parametrize("make", [uneven, tied, periodic, one, nothing])
@pytest.mark.parametrize("size", [*SIZES, 200_003])
def test_topk_sends_the_largest(size: int, make: Callable[[int], Vector]) -> None:
    values = make(size)
    sent, rest = taken(TopK, values)
    count = max(round(TOP_SHARE * size), 1)
    indices = sent.indices  # type: ignore[union-attr]
    assert len(indices) == count
    assert (np.diff(indices.astype(np.int64)) > 0).all()
    magnitudes = np.abs(values)
    np.testing.assert_array_equal(np.sort(magnitudes[indices]), np.sort(magnitudes)[-count:])
    others = np.delete(np.arange(size), indices)
    np.testing.assert_array_equal(rest[others], values[others])
    np.testing.assert_allclose(received(sent) + rest, values, rtol=1e-6)
    assert (received(sent)[others] == 0).all()


@pytest.mark.parametrize(("codec", "size"), [(Bf16, 1024), (Int8, 1024), (TopK, 102_400)])
def test_nothing_that_is_sent_is_longer_than_the_bound(codec: type[Bf16 | Int8 | TopK], size: int) -> None:
    above_half = 1.0 + 2.0**-8 + 2.0**-20  # bf16 rounds it up
    uneven_blocks = np.full(size, 0.5001, np.float32)
    uneven_blocks[::INT8_BLOCK] = 127.0  # and int8 all of a block but one
    # 1024 equal entries travel, each just above the half once they are scaled down.
    for values, largest in ((np.full(size, 5.0, np.float32), 32 * above_half), (uneven_blocks, 2.0)):
        sent, _ = taken(codec, values, largest)
        norm = np.linalg.norm(received(sent).astype(np.float64))
        assert 0.99 * largest < norm <= largest * (1 + 1e-5)


@pytest.mark.parametrize("codec", CODECS)
def test_what_is_cut_off_does_not_stay(codec: type[Bf16 | Int8 | TopK]) -> None:
    values = vector(5, norm=50.0)
    sent, rest = taken(codec, values, 1.0)
    there = received(sent) != 0
    assert np.linalg.norm(rest[there]) < 0.1


@pytest.mark.parametrize("codec", CODECS)
def test_the_same_is_made_of_the_same(codec: type[Bf16 | Int8 | TopK]) -> None:
    codecs: list[Codec] = [codec(20_011), codec(20_011)]
    codecs[0].take(torch.from_numpy(vector(6)), 1.0, LATE)  # what came before leaves no trace in a codec
    first, second = (one.take(torch.from_numpy(vector(7)), 1.0, LATE) for one in codecs)
    for mine, theirs in zip(first, second, strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_topk_sends_more_of_the_first_gradients() -> None:
    sizes = [TopK(10_000).take(torch.from_numpy(vector(8, 10_000)), 1.0, version).indices.size for version in VERSIONS]
    assert sizes == [2500, 1250, 625, 100, 100]
    # All that is more takes no more entries than a dozen gradients in full.
    assert sum(share_at(version) - TOP_SHARE for version in range(1000)) < 13
