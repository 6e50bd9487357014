"""How fast the policy learns with each gradient codec, in one process: actors take turns, each a few updates behind.

python -m tests.campaigns.codecs --codec fp32 --codec topk --scene bathroom/1 --scene kitchen/1

A minute or a few for each codec; whole runs over Zenoh, measured on rooms that they never saw, are those of
`tests.campaigns.learning`.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple, get_args

import click
import numpy as np
import torch

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.a3c.compression.decompressor import Decompressor
from hoz_dist.bench.loop import collectors_in
from hoz_dist.config import Compression, RunConfig
from hoz_dist.gradient_forms import Vector
from hoz_dist.nav.rooms import RoomId, training_rooms
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.sim.view_store import default_cache
from learner.optimizer import FlatAdam, lag_weight

EPISODES: Final = 3000
"""Last episodes whose success is told."""
EVERY: Final = 100
"""Updates between two lines."""


class Line(NamedTuple):
    """How far a training is."""

    updates: int
    success: float
    """Share of the last episodes in training."""
    left: float
    """Norm of what the codec has left of the last gradient and all before."""


def train(config: RunConfig, rooms: Sequence[RoomId], actors: int, updates: int) -> Iterator[Line]:
    """Train; yields every so many updates."""
    adam = FlatAdam(initial_parameters(config.policy, config.seed), config.learning_rate)
    decompressor = Decompressor(adam.size)
    names = [f"actor-{number}" for number in range(actors)]
    collectors = collectors_in(config, rooms, default_cache(), None, names)
    compressors = [Compressor(config.compress, adam.size, config.gradient_norm) for _ in names]
    errors = [np.zeros(adam.size, np.float32) for _ in names]
    waiting: deque[tuple[int, int, Vector]] = deque()
    ended: deque[bool] = deque(maxlen=EPISODES)
    for update in range(updates):
        if len(waiting) == actors:
            actor, version, gradient = waiting.popleft()
            sent = compressors[actor].compress(gradient, version)
            compressors[actor].accepted()
            errors[actor] += gradient - decompressor.decompress(sent).vector
            adam.set_progress(update / updates)
            adam.step(decompressor.decompress(sent, lag_weight(actors - 1)).vector)
        actor = update % actors
        collectors[actor].load(adam.parameters, adam.updates)
        rollout = collectors[actor].roll_out()
        waiting.append((actor, max(update - actors, 0), rollout.gradient.copy()))
        ended += [result.success for result in rollout.finished]
        if (update + 1) % EVERY == 0:
            yield Line(update + 1, float(np.mean(ended)), float(np.linalg.norm(errors[actor])))


@click.command()
@click.option("--codec", "codecs", multiple=True, type=click.Choice(get_args(Compression)), default=("fp32", "topk"))
@click.option("--seed", type=int, default=0, show_default=True)
@click.option("--updates", type=int, default=600, show_default=True)
@click.option("--actors", type=int, default=2, show_default=True)
@click.option("--scene", "scenes", multiple=True, default=("bathroom",), show_default=True)
def main(codecs: tuple[Compression, ...], seed: int, updates: int, actors: int, scenes: tuple[str, ...]) -> None:
    """Train with each codec, and print success as it grows."""
    torch.set_num_threads(1)
    for codec in codecs:
        for line in train(RunConfig(seed=seed, compress=codec), training_rooms(scenes), actors, updates):
            click.echo(f"{codec}  {line.updates} updates  success {line.success:.3f}  left {line.left:.2f}")


if __name__ == "__main__":
    main()
