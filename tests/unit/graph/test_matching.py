import itertools

import numpy as np
import pytest

from hoz_dist.graph.matching import distance, match


def test_distance_by_hand() -> None:
    # ||(1, 0) - (1, 1)|| = 1, a.b = 1
    assert distance(np.array([1.0, 0.0]), np.array([1.0, 1.0])) == pytest.approx(1 + 1 / 1.1)


def test_distance_of_nothing_in_common_is_finite() -> None:
    assert distance(np.zeros(22), np.zeros(22)) == pytest.approx(10.0)


def test_distance_of_a_zone_to_itself_is_positive() -> None:
    node = np.ones(22)
    assert distance(node, node) == pytest.approx(1 / 22.1)


def test_matching_agrees_with_all_permutations() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        a, b = rng.random((2, 5, 22))
        weights = 1 / distance(a[:, None], b[None])
        best = max(sum(weights[i, j] for i, j in enumerate(order)) for order in itertools.permutations(range(5)))
        assert weights[np.arange(5), match(a, b)].sum() == pytest.approx(best, abs=1e-8)


def test_matching_undoes_a_permutation() -> None:
    rng = np.random.default_rng(1)
    nodes, order = rng.random((8, 22)), rng.permutation(8)
    np.testing.assert_array_equal(order[match(nodes, nodes[order])], np.arange(8))


def test_zones_that_are_alike_keep_their_numbers() -> None:
    nodes = np.full((8, 22), 0.5)
    np.testing.assert_array_equal(match(nodes, nodes), np.arange(8))
