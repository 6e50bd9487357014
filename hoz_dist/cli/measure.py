"""Measures a checkpoint and shows the progress: what `hoz-dist evaluate` and the end of `hoz-dist train` share."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from hoz_dist.cli.progress import Progress
from hoz_dist.errors import NotFoundError
from hoz_dist.evaluation.agents import PolicyAgent
from hoz_dist.evaluation.benchmark import Benchmark, Comparison, compare
from hoz_dist.evaluation.loading import load_agent, matching_encoder, open_rooms
from hoz_dist.nav.categories import SCENES, scene_index
from hoz_dist.nav.rooms import SPLITS, Split
from hoz_dist.sim.view_store import ViewStore, default_cache
from learner.checkpoint import Checkpoint


class Measurement(NamedTuple):
    """What was measured, and on what."""

    comparison: Comparison
    benchmark: Benchmark
    agent: PolicyAgent


def measure(
    checkpoint: Checkpoint,
    *,
    split: Split,
    seeds: Sequence[int],
    episodes: int,
    scenes: Sequence[str] = (),
    weights: Path | None = None,
    cache: Path | None = None,
) -> Measurement:
    """Run a checkpoint's agent, Random and Oracle on the same episodes.

    Args:
        checkpoint: The checkpoint.
        split: Rooms to use.
        seeds: Seed of each trial.
        episodes: Number of episodes in each scene.
        scenes: Scenes; those that the checkpoint was trained in when there are none.
        weights: Weights of the resnet18 encoder.
        cache: Folder of the view store; the default one when None.

    Raises:
        HozError: A scene does not exist, the checkpoint holds no scene, or its parts do not fit.
    """
    import torch

    # Results do not depend on the number of cores, and small products gain nothing from more threads.
    torch.set_num_threads(1)
    for scene in scenes:
        scene_index(scene)
    trained = {room.room.partition("/")[0] for room in checkpoint.rooms}
    wanted = [scene for scene in SCENES if scene in (set(scenes) or trained)]
    if not wanted:
        message = "The checkpoint was saved before any room was explored; train longer, or name scenes by --scene."
        raise NotFoundError(message)
    config = checkpoint.config
    agent = load_agent(config, checkpoint.parameters, checkpoint.scene_graphs())
    encoder = matching_encoder(config, weights)
    store = ViewStore(cache or default_cache(), config.picture_size)
    opened = 0
    with Progress("Opening rooms", len(wanted) * len(SPLITS[split]), "rooms") as progress:

        def show_room(room: str) -> None:
            nonlocal opened
            opened += 1
            progress.update(opened, room)

        rooms = open_rooms(store, encoder, wanted, split, show_room)
    benchmark = Benchmark.of(rooms, split, episodes)
    trials = 2 * len(seeds) + 1  # of Random and the policy; Oracle draws nothing and has one
    with Progress("Evaluating", len(benchmark.episodes) * trials, "episodes") as progress:
        comparison = compare(benchmark, agent, list(seeds), progress.update)
    return Measurement(comparison, benchmark, agent)
