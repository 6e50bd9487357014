from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.views import Views
from hoz_dist.graph.zones import Clustering, cluster
from tests.unit.graph.samples import random_bags


def some_views(count: int, distinct: int, seed: int = 0) -> Views:
    """Views of a room with that many distinct bags at most."""
    rng = np.random.default_rng(seed)
    bags = random_bags(distinct, rng)[rng.integers(distinct, size=count)]
    return Views(bags, rng.integers(0, 10, (count, 2)).astype(np.int16))


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 12), st.integers(0, 60), st.integers(1, 20), st.integers(0, 2**32 - 1))
def test_there_are_exactly_k_zones_and_none_is_empty(zones: int, more: int, distinct: int, seed: int) -> None:
    views = some_views(zones + more, distinct, seed % 1000)
    labels = cluster(views, zones, seed)
    assert labels.shape == (zones + more,)
    assert sorted(set(labels.tolist())) == list(range(zones))


def test_same_seed_gives_same_zones() -> None:
    views = some_views(500, 60)
    np.testing.assert_array_equal(cluster(views, 8, 5), cluster(views, 8, 5))


def test_order_of_views_does_not_matter() -> None:
    views = some_views(300, 50)
    order = np.random.default_rng(1).permutation(300)
    shuffled = cluster(Views(views.bags[order], views.positions[order]), 8, 5)
    np.testing.assert_array_equal(cluster(views, 8, 5)[order], shuffled)


def test_clear_clusters_are_found() -> None:
    truth = np.repeat(np.arange(4), 25)
    bags = np.zeros((100, 22), dtype=np.bool_)
    for zone in range(4):
        bags[truth == zone, zone * 5 : zone * 5 + 5] = True
    noisy = bags.copy()
    noisy[np.arange(100), np.random.default_rng(0).integers(0, 20, 100)] ^= True
    labels = cluster(Views(noisy, np.zeros((100, 2), dtype=np.int16)), 4, 0)
    assert len({(int(a), int(b)) for a, b in zip(truth, labels, strict=True)}) == 4


def test_zones_are_those_of_the_views_not_of_the_distinct_bags() -> None:
    # Bags 0, 1 and 3 objects apart: distinct bags would pair the first two, but nearly all views have these.
    bags = np.repeat(np.array([[0, 0, 0, 0], [1, 0, 0, 0], [1, 1, 1, 0]], dtype=np.bool_), [100, 100, 1], axis=0)
    labels = cluster(Views(bags, np.zeros((201, 2), dtype=np.int16)), 2, 0)
    assert labels[0] != labels[100] == labels[200]


def test_one_bag_everywhere_is_split_by_position() -> None:
    positions = np.stack(np.meshgrid(np.arange(8), np.arange(2)), axis=-1).reshape(-1, 2).astype(np.int16)
    labels = cluster(Views(np.ones((16, 22), dtype=np.bool_), positions), 2, 0)
    far = labels[positions[:, 0].argmax()]
    np.testing.assert_array_equal(labels == far, positions[:, 0] >= 4)


def test_views_of_one_position_are_split_only_if_all_are_there() -> None:
    labels = cluster(Views(np.ones((6, 22), dtype=np.bool_), np.zeros((6, 2), dtype=np.int16)), 2, 0)
    assert np.bincount(labels).tolist() == [3, 3]


def test_fewer_distinct_bags_than_zones_keep_bags_apart() -> None:
    views = some_views(100, 3)
    labels = cluster(views, 8, 0)
    for zone in range(8):
        assert len(np.unique(views.bags[labels == zone], axis=0)) == 1


@pytest.mark.parametrize("zones", [0, -1, 65])
def test_number_of_zones_out_of_range_is_refused(zones: int) -> None:
    with pytest.raises(InvalidValueError, match="number of zones must be 1 to 64"):
        cluster(some_views(100, 20), zones, 0)


def test_fewer_views_than_zones_are_refused() -> None:
    with pytest.raises(InvalidValueError, match="5 views cannot have 8 zones; use at most 5"):
        cluster(some_views(5, 5), 8, 0)


CLUSTERINGS: list[Clustering] = list(get_args(Clustering))


@pytest.mark.parametrize("clustering", CLUSTERINGS)
@pytest.mark.parametrize(("count", "distinct", "zones"), [(400, 60, 8), (40, 3, 8), (30, 9, 8)])
def test_every_clustering_gives_k_zones_and_the_same_again(
    clustering: Clustering, count: int, distinct: int, zones: int
) -> None:
    views = some_views(count, distinct)
    labels = cluster(views, zones, 3, clustering)
    assert sorted(set(labels.tolist())) == list(range(zones))
    np.testing.assert_array_equal(labels, cluster(views, zones, 3, clustering))


@pytest.mark.parametrize("clustering", ["spectral", "agglomerative"])
def test_other_clusterings_find_clear_clusters_too(clustering: Clustering) -> None:
    truth = np.repeat(np.arange(4), 25)
    bags = np.zeros((100, 22), dtype=np.bool_)
    for zone in range(4):
        bags[truth == zone, zone * 5 : zone * 5 + 5] = True
    bags[np.arange(100), np.random.default_rng(0).integers(0, 20, 100)] ^= True
    labels = cluster(Views(bags, np.zeros((100, 2), dtype=np.int16)), 4, 0, clustering)
    assert len({(int(a), int(b)) for a, b in zip(truth, labels, strict=True)}) == 4


def test_zones_of_positions_are_places_whatever_is_seen_there() -> None:
    positions = np.repeat(np.array([[0, 0], [1, 0], [20, 20], [21, 20]], dtype=np.int16), 16, axis=0)
    bags = random_bags(64, np.random.default_rng(0))
    labels = cluster(Views(bags, positions), 2, 0, "positions")
    assert len(set(labels[:32].tolist())) == len(set(labels[32:].tolist())) == 1
    assert labels[0] != labels[32]
