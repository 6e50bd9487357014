"""The scene graphs that a policy can use, as arrays indexed by scene."""

from collections.abc import Mapping

import torch

from hoz_dist.graph.planner import EdgeCost, Subgoal, normalized_adjacency, subgoals
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import SCENES, TARGETS


class GraphBank:
    """Nodes, normalised adjacencies and sub-goals of the scene graphs known so far.

    Attributes:
        nodes: delta_0, [S, K, N].
        adjacency: E_hat, [S, K, K].
        subgoals: Sub-goal zone by current and target zone, [S, K, K].
        available: Whether the scene's graph is known, [S].
    """

    def __init__(self, zones: int, edge_cost: EdgeCost, subgoal: Subgoal = "path") -> None:
        self._edge_cost = edge_cost
        self._subgoal: Subgoal = subgoal
        self.nodes = torch.zeros(len(SCENES), zones, len(TARGETS))
        self.adjacency = torch.zeros(len(SCENES), zones, zones)
        self.subgoals = torch.zeros(len(SCENES), zones, zones, dtype=torch.int64)
        self.available = torch.zeros(len(SCENES), dtype=torch.bool)

    @classmethod
    def of(
        cls, graphs: Mapping[str, SceneGraph], zones: int, edge_cost: EdgeCost, subgoal: Subgoal = "path"
    ) -> "GraphBank":
        """Make a bank that holds some graphs, by scene."""
        bank = cls(zones, edge_cost, subgoal)
        for graph in graphs.values():
            bank.put(graph)
        return bank

    def put(self, graph: SceneGraph) -> None:
        """Add a scene's graph, or replace it.

        Raises:
            ValueError: The graph has other zones or categories.
        """
        index = SCENES.index(graph.scene)
        if graph.nodes.shape != self.nodes.shape[1:] or tuple(graph.categories) != TARGETS:
            message = f"graph of {graph.scene} has {graph.nodes.shape} nodes, expected {tuple(self.nodes.shape[1:])}"
            raise ValueError(message)
        self.nodes[index] = torch.from_numpy(graph.nodes)
        self.adjacency[index] = torch.from_numpy(normalized_adjacency(graph.edges))
        self.subgoals[index] = torch.from_numpy(subgoals(graph.edges, self._edge_cost, self._subgoal))
        self.available[index] = True
