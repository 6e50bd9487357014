"""The scene graphs that the authors released, not part of this repository. See docs/decisions/edge-cost.md."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.graph.files import load_graph, save_graph
from hoz_dist.graph.planner import EDGE_COSTS, EdgeCost, plan
from tests.unit.graph.exhaustive import best_path

RELEASED = Path(__file__).parents[4] / "shared" / "reference"

pytestmark = pytest.mark.skipif(not RELEASED.is_dir(), reason="needs the released graphs in ../shared/reference")
released_graphs = pytest.mark.parametrize(("name", "scene"), [("Kitchens", "kitchen"), ("Bedrooms", "bedroom")])
PAIRS = list(itertools.permutations(range(8), 2))


@released_graphs
def test_graph_loads_with_its_scene(name: str, scene: str) -> None:
    graph = load_graph(RELEASED / f"{name}.mat")
    assert (graph.scene, graph.version, graph.rooms) == (scene, 0, ())
    assert graph.nodes.shape == (8, 22)


@released_graphs
def test_graph_survives_json_and_back_to_the_last_bit(name: str, scene: str, tmp_path: Path) -> None:
    original = load_graph(RELEASED / f"{name}.mat")
    save_graph(original, tmp_path / "graph.json")
    save_graph(load_graph(tmp_path / "graph.json"), tmp_path / "graph.mat")
    returned = load_graph(tmp_path / "graph.mat", scene)
    np.testing.assert_array_equal(returned.nodes, original.nodes)
    np.testing.assert_array_equal(returned.edges, original.edges)


@released_graphs
@pytest.mark.parametrize("edge_cost", EDGE_COSTS)
def test_plans_agree_with_an_exhaustive_search(name: str, scene: str, edge_cost: EdgeCost) -> None:
    edges = load_graph(RELEASED / f"{name}.mat").edges
    for current, target in PAIRS:
        assert plan(edges, current, target, edge_cost).path == best_path(edges, current, target, edge_cost)


@pytest.mark.parametrize(
    ("name", "edge_cost", "share"),
    [
        ("Kitchens", "product", 0.0),
        ("Kitchens", "normalized", 36 / 56),
        ("Bedrooms", "product", 0.0),
        ("Bedrooms", "normalized", 18 / 56),
    ],
)
def test_share_of_pairs_with_zones_in_between(name: str, edge_cost: EdgeCost, share: float) -> None:
    edges = load_graph(RELEASED / f"{name}.mat").edges
    assert np.mean([len(plan(edges, *pair, edge_cost).path) > 2 for pair in PAIRS]) == share
