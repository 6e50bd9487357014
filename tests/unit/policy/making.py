"""Observations and graphs made by hand."""

import numpy as np

from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph, merge_rooms
from hoz_dist.nav.categories import ROOM_SCENES, SCENES, TARGETS
from hoz_dist.nav.feedback import PREVIOUS_ACTIONS
from hoz_dist.nav.observation import Observation

CHANNELS = 6


def make_observation(*shape: int, seed: int = 0) -> Observation:
    """Make random observations [*shape]; episodes begin at about one step in five, and at the first."""
    rng = np.random.default_rng(seed)
    categories = len(TARGETS)
    seen = rng.random((*shape, categories)) < 0.2
    detections = rng.random((*shape, categories, 5), dtype=np.float32)
    detections[..., 4] = 1.0
    first = rng.random(shape) < 0.2
    if len(shape) > 1:
        first[0] = True
    return Observation(
        features=rng.standard_normal((*shape, CHANNELS, 7, 7), dtype=np.float32),
        detections=np.where(seen[..., None], detections, np.float32(0.0)),
        appearance=np.where(seen[..., None], rng.random((*shape, categories, CHANNELS), dtype=np.float32), 0.0).astype(
            np.float32
        ),
        target=rng.integers(categories, size=shape),
        previous_action=rng.integers(PREVIOUS_ACTIONS, size=shape),
        scene=rng.integers(len(ROOM_SCENES), size=shape),
        first=first,
    )


def step_of(observation: Observation, t: int) -> Observation:
    """Return step t of observations [T, B]."""
    return Observation(*(part[t] for part in observation))


def make_scene_graph(scene: str, zones: int = 8, seed: int = 0) -> SceneGraph:
    """Make a scene graph of random numbers."""
    rng = np.random.default_rng([seed, SCENES.index(scene)])
    edges = rng.random((zones, zones)) * 0.2
    edges = (edges + edges.T) / 2
    np.fill_diagonal(edges, 1.0)
    nodes = rng.random((zones, len(TARGETS)))
    return merge_rooms(scene, [RoomGraph(f"{scene}/1", "0" * 32, nodes, edges)], version=1)
