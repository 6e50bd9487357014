"""From a checkpoint to its agent, its rooms and what it reaches, with the progress shown.

`hoz-dist evaluate`, `analyse`, `reproduce` and the end of `train` share it.
"""

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from hoz_dist.cli.progress import Progress
from hoz_dist.cli.rendering import Encoding, render_missing
from hoz_dist.errors import NotFoundError
from hoz_dist.evaluation.agents import PolicyAgent
from hoz_dist.evaluation.benchmark import Benchmark, Comparison, compare
from hoz_dist.evaluation.loading import load_agent, matching_encoder
from hoz_dist.evaluation.protocol import TEMPERATURE
from hoz_dist.evaluation.trials import stored_views
from hoz_dist.nav.categories import SCENES, scene_index
from hoz_dist.nav.rooms import Split, rooms_of
from hoz_dist.policy.threads import use_one_thread
from hoz_dist.sim.live import LiveViews
from hoz_dist.sim.view_store import ViewStore, default_cache
from learner.checkpoint import Checkpoint


class Measurement(NamedTuple):
    """What was measured, and on what."""

    comparison: Comparison
    benchmark: Benchmark
    agent: PolicyAgent


def open_benchmark(
    checkpoint: Checkpoint,
    *,
    split: Split,
    episodes: int,
    scenes: Sequence[str] = (),
    weights: Path | None = None,
    cache: Path | None = None,
) -> Benchmark:
    """Open the rooms that a checkpoint is measured in, rendering those that the cache lacks.

    Args:
        checkpoint: The checkpoint.
        split: Rooms to use.
        episodes: Number of episodes in each scene.
        scenes: Scenes; those that the checkpoint was trained in when there are none.
        weights: Weights of the resnet18 encoder.
        cache: Folder of the view store; the default one when None.

    Raises:
        HozError: A scene does not exist, the checkpoint holds no scene, or the weights are not its own.
    """
    for scene in scenes:
        scene_index(scene)
    trained = set(checkpoint.graph_versions)
    wanted = [scene for scene in SCENES if scene in (set(scenes) or trained)]
    if not wanted:
        message = "The checkpoint was saved before any room was explored; train longer, or name scenes by --scene."
        raise NotFoundError(message)
    config = checkpoint.config
    encoder = matching_encoder(config, weights)
    folder = cache or default_cache()
    store = ViewStore(folder, config.picture_size)
    names = [room for scene in wanted for room in rooms_of(scene, split)]
    jobs = len(os.sched_getaffinity(0))
    render_missing(names, folder, config.picture_size, jobs, Encoding(config.encoder, weights))
    return Benchmark.of([store.open(room, encoder) for room in names], split, episodes)


def agent_of(checkpoint: Checkpoint, temperature: float = TEMPERATURE) -> PolicyAgent:
    """Return the agent that a checkpoint holds.

    Raises:
        HozError: The checkpoint's parts do not fit, or it lacks the graphs that guide its agent.
    """
    return load_agent(checkpoint.config, checkpoint.parameters, checkpoint.scene_graphs(), temperature)


def measure(
    checkpoint: Checkpoint,
    *,
    split: Split,
    seeds: Sequence[int],
    episodes: int,
    scenes: Sequence[str] = (),
    temperature: float = TEMPERATURE,
    weights: Path | None = None,
    cache: Path | None = None,
    live: bool = False,
) -> Measurement:
    """Run a checkpoint's agent, Random and Oracle on the same episodes.

    Args:
        checkpoint: The checkpoint.
        split: Rooms to use.
        seeds: Seed of each trial.
        episodes: Number of episodes in each scene.
        scenes: Scenes; those that the checkpoint was trained in when there are none.
        temperature: By which logits are divided before actions are drawn.
        weights: Weights of the resnet18 encoder.
        cache: Folder of the view store; the default one when None.
        live: Render what the policy sees at every step, instead of looking it up.

    Raises:
        HozError: A scene does not exist, the checkpoint holds no scene, or its parts do not fit.
    """
    use_one_thread()
    config = checkpoint.config
    agent = agent_of(checkpoint, temperature)
    benchmark = open_benchmark(checkpoint, split=split, episodes=episodes, scenes=scenes, weights=weights, cache=cache)
    trials = 2 * len(seeds) + 1  # of Random and the policy; Oracle draws nothing and has one
    with Progress("Evaluating", len(benchmark.episodes) * trials, "episodes") as progress:
        encoder = matching_encoder(config, weights) if live else None
        source = stored_views if encoder is None else partial(LiveViews, encoder, config.picture_size)
        comparison = compare(benchmark, agent, list(seeds), source, progress.update)
    return Measurement(comparison, benchmark, agent)
