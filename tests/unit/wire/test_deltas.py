import numpy as np
import pytest

from hoz_dist.wire.protocol.deltas import Quantised, add, quantise
from hoz_dist.wire.protocol.parameters import BLOCK

SIZES = [1, BLOCK - 1, BLOCK, BLOCK + 1, 300 * BLOCK, 300 * BLOCK + 17]


def vectors(size: int) -> tuple[np.ndarray, np.ndarray]:
    """A base and what it became, [P] each; blocks moved by different amounts, and the second one not at all."""
    rng = np.random.default_rng(size)
    base = rng.normal(size=size).astype(np.float32)
    moved = rng.normal(size=size) * np.logspace(-6, 1, size)
    moved[BLOCK : 2 * BLOCK] = 0.0
    return base, base + moved.astype(np.float32)


@pytest.mark.parametrize("size", SIZES)
def test_every_value_is_off_by_half_of_its_scale_at_most(size: int) -> None:
    base, vector = vectors(size)
    delta = quantise(vector, base)
    made = np.empty_like(base)
    add(base, delta, made)
    rounding = 2e-7 * np.abs(vector)
    scales = np.repeat(delta.scales, BLOCK)[:size]
    assert (np.abs(made - vector) <= 0.501 * scales + rounding).all()
    for block in range(-(-size // BLOCK)):
        part = slice(block * BLOCK, (block + 1) * BLOCK)
        assert delta.scales[block] == np.abs(vector[part] - base[part]).max() / np.float32(127)


def test_the_formula_is_the_documented_one() -> None:
    base, vector = vectors(2 * BLOCK + 3)
    scales, values = delta = quantise(vector, base)
    assert values.dtype == np.int8
    made = np.empty_like(base)
    add(base, delta, made)
    expected = [
        np.float32(b + np.float32(np.float32(v) * scales[i // BLOCK]))
        for i, (b, v) in enumerate(zip(base, values, strict=True))
    ]
    np.testing.assert_array_equal(made, expected)


def test_parts_make_the_same_as_the_whole() -> None:
    base, vector = vectors(4 * BLOCK + 5)
    delta = quantise(vector, base)
    whole, parts = np.empty_like(base), np.empty_like(base)
    add(base, delta, whole)
    for start, stop in ((0, BLOCK), (BLOCK, 4 * BLOCK), (4 * BLOCK, base.size)):
        scales = delta.scales[start // BLOCK : -(-stop // BLOCK)]
        add(base[start:stop], Quantised(scales, delta.values[start:stop]), parts[start:stop])
    np.testing.assert_array_equal(parts, whole)


@pytest.mark.parametrize("moved", [0.0, 1e-38, 1e-44])
def test_what_hardly_moved_stays(moved: float) -> None:
    base = np.zeros(BLOCK, np.float32)
    delta = quantise(base + np.float32(moved), base)
    assert not delta.scales.any()
    assert not delta.values.any()


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_has_a_scale_that_is_not(wrong: float) -> None:
    base = np.zeros(3 * BLOCK, np.float32)
    vector = base.copy()
    vector[BLOCK + 5] = wrong
    np.testing.assert_array_equal(np.isfinite(quantise(vector, base).scales), [True, False, True])
