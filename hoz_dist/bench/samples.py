"""Made-up observations, graphs and gradients: speed does not depend on what they say, only on their shapes."""

import numpy as np
from numpy.typing import NDArray

from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph, merge_rooms
from hoz_dist.nav.categories import SCENES, TARGETS
from hoz_dist.nav.feedback import PREVIOUS_ACTIONS
from hoz_dist.nav.observation import Observation
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.settings import PolicySettings

LATE = 1_000_000
"""A version of the parameters: of the first ones `TopK` sends more than of all others."""
SEEN_SHARE = 0.15
"""Share of the categories that a view shows."""
FIRST_SHARE = 1 / 30
"""Share of the steps at which an episode begins."""


def observations(settings: PolicySettings, *shape: int) -> Observation:
    """Make observations of a shape, [B] or [T, B]."""
    rng = np.random.default_rng(0)
    seen = (rng.random((*shape, len(TARGETS))) < SEEN_SHARE)[..., None]
    detections = rng.random((*shape, len(TARGETS), 5), dtype=np.float32)
    detections[..., 4] = 1.0
    return Observation(
        features=rng.standard_normal((*shape, settings.channels, settings.grid, settings.grid), dtype=np.float32),
        detections=detections * seen,
        appearance=rng.random((*shape, len(TARGETS), settings.channels), dtype=np.float32) * seen,
        target=rng.integers(len(TARGETS), size=shape),
        previous_action=rng.integers(PREVIOUS_ACTIONS, size=shape),
        scene=rng.integers(settings.scenes, size=shape),
        first=rng.random(shape) < FIRST_SHARE,
    )


def room_graph(room: RoomId, digest: str, zones: int) -> RoomGraph:
    """Make a graph of K zones of a room with some digest."""
    rng = np.random.default_rng(SCENES.index(room.scene))
    edges = rng.uniform(0.01, 0.3, (zones, zones))
    edges = (edges + edges.T) / 2
    np.fill_diagonal(edges, 1.0)
    return RoomGraph(str(room), digest, rng.random((zones, len(TARGETS))), edges)


def graph_bank(zones: int) -> GraphBank:
    """Make the graphs of all scenes."""
    graphs: dict[str, SceneGraph] = {}
    for scene in SCENES:
        graphs[scene] = merge_rooms(scene, [room_graph(RoomId(scene, 1), "0", zones)], version=1)
    return GraphBank.of(graphs, zones, "product")


def gradient(size: int) -> NDArray[np.float32]:
    """Make a gradient [P] that is short enough for every run, of entries as unequal as a network's."""
    rng = np.random.default_rng(0)
    values = rng.standard_normal(size, dtype=np.float32) ** 3
    return np.asarray(values * np.float32(0.5 / np.linalg.norm(values)))
