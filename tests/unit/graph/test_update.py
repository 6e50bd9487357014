import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hoz_dist.graph.matching import distance
from hoz_dist.graph.update import current_zone, update


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.001, 0.999))
def test_update_is_a_convex_combination_of_the_current_zone_and_what_is_seen(seed: int, lam: float) -> None:
    rng = np.random.default_rng(seed)
    nodes, bag, zone = rng.random((8, 22)), (rng.random(22) < 0.3).astype(np.float64), int(rng.integers(8))
    updated = update(nodes, bag, zone, lam)
    np.testing.assert_allclose(updated[zone], lam * bag + (1 - lam) * nodes[zone])
    np.testing.assert_array_equal(np.delete(updated, zone, axis=0), np.delete(nodes, zone, axis=0))
    assert updated.min() >= 0
    assert updated.max() <= 1


def test_update_is_equation_4_in_matrices() -> None:
    rng = np.random.default_rng(0)
    nodes, bag = rng.random((8, 22)), rng.random(22)
    indicator = np.eye(8)[:, [3]]  # Zc, [K, 1]
    expected = 0.3 * indicator @ bag[None] + (np.eye(8) - 0.3 * indicator @ indicator.T) @ nodes
    np.testing.assert_allclose(update(nodes, bag, 3, 0.3), expected)


def test_update_leaves_the_given_nodes_alone() -> None:
    nodes = np.full((8, 22), 0.5)
    update(nodes, np.ones(22), 0, 0.5)
    assert (nodes == 0.5).all()


def test_current_zone_is_the_closest() -> None:
    rng = np.random.default_rng(0)
    nodes, bag = rng.random((8, 22)), rng.random(22) < 0.3
    assert current_zone(nodes, bag) == min(range(8), key=lambda zone: float(distance(nodes[zone], bag.astype(float))))


@pytest.mark.parametrize("zone", range(4))
def test_seeing_what_a_zone_shows_finds_that_zone(zone: int) -> None:
    nodes = np.zeros((4, 22))
    for number in range(4):
        nodes[number, number * 5 : number * 5 + 5] = 0.8
    assert current_zone(nodes, nodes[zone] > 0) == zone


def test_episodes_in_a_batch_do_not_mix() -> None:
    rng = np.random.default_rng(0)
    nodes, bags = rng.random((5, 8, 22)), rng.random((5, 22))
    zones = current_zone(nodes, bags)
    updated = update(nodes, bags, zones, 0.4)
    for episode in range(5):
        assert zones[episode] == current_zone(nodes[episode], bags[episode])
        alone = update(nodes[episode], bags[episode], int(zones[episode]), 0.4)
        np.testing.assert_array_equal(updated[episode], alone)
