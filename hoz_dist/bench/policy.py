"""`hoz-dist bench policy`: frames that a policy acts in, and learns from, in a second."""

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Final, get_args

import torch

from hoz_dist.a3c.differentiation import Differentiator
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.bench.products import Product, acting_products, run_products, training_products
from hoz_dist.bench.report import Metric
from hoz_dist.bench.samples import graph_bank, observations
from hoz_dist.bench.timing import Contender, Contest, Progress, Samples, core_seconds, rate, run_contests
from hoz_dist.config import PRESET_PRECISIONS, RunConfig
from hoz_dist.nav.actions import Action
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.settings import Precision, Preset
from hoz_dist.policy.tape import dtype_of
from hoz_dist.policy.threads import use_one_thread

ACTING_BATCHES: Final = (1, 64)
TRAINING_BATCHES: Final = (16, 64)
_UNIT: Final = "frames/s"


def bench_policy(
    presets: Sequence[Preset], *, steps: int, seconds: float, repeats: int, progress: Progress
) -> dict[str, Metric]:
    """Measure frames per second of a core with method `hoz`; the limit is the matrix products alone.

    Acting is T steps of B episodes. Training is the gradient of the loss of a rollout of T steps of B episodes: with
    the forward pass; and without that of the LSTM, from what acting recorded of it, as actors do. The products are
    those of a rollout in the best order, in the type in which they run faster of those that the policy uses.

    Args:
        presets: Sizes of the network; each in its own precision.
        steps: T.
        seconds: Length of one measurement.
        repeats: Measurements of each figure.
        progress: Told how far the work is.
    """
    use_one_thread()
    contests: dict[str, Contest] = {}
    for preset in presets:
        for batch in ACTING_BATCHES:
            name = f"policy_act_{preset}_b{batch}"
            contests[name] = partial(_acting, name, _config(preset, steps, batch), seconds)
        for batch in TRAINING_BATCHES:
            for kind in ("train", "train_recorded"):
                name = f"policy_{kind}_{preset}_b{batch}"
                config = _config(preset, steps, batch)
                contests[name] = partial(_training, name, config, seconds, recorded=kind != "train")
    samples = run_contests(list(contests.values()), repeats, progress)
    return {name: Metric.of(samples[name], _UNIT, _limit(samples, name)) for name in contests}


def _config(preset: Preset, steps: int, batch: int) -> RunConfig:
    return RunConfig(preset=preset, precision=PRESET_PRECISIONS[preset], batch=batch, rollout_steps=steps)


def _limit(samples: Samples, name: str) -> float:
    """Return the speed of the faster products."""
    kinds = [f"{name}, {precision} products" for precision in get_args(Precision)]
    return max(statistics.median(samples[kind]) for kind in kinds if kind in samples)


@contextmanager
def _acting(name: str, config: RunConfig, seconds: float) -> Iterator[Mapping[str, Contender]]:
    policy, bank = make_policy(config.policy, config.seed), graph_bank(config.zones)
    observation, state = observations(config.policy, config.batch), policy.initial_state(config.batch)
    tape = policy.tape(config.rollout_steps, config.batch)

    def act() -> None:
        nonlocal state
        tape.rewind()
        for _ in range(config.rollout_steps):
            state = policy.act(observation, state, bank, tape).state

    once = acting_products(policy, config.batch)
    products = [product._replace(times=product.times * config.rollout_steps) for product in once]
    with torch.no_grad():
        yield _contenders(name, act, products, config, seconds)


@contextmanager
def _training(name: str, config: RunConfig, seconds: float, *, recorded: bool) -> Iterator[Mapping[str, Contender]]:
    steps, batch = config.rollout_steps, config.batch
    policy, bank = make_policy(config.policy, config.seed), graph_bank(config.zones)
    differentiator = Differentiator(config, policy, FlatParameters(policy))
    observation, start = observations(config.policy, steps, batch), policy.initial_state(batch)
    tape = policy.tape(steps, batch)
    state, decisions = start, []
    for t in range(steps):
        decisions.append(policy.act(Observation(*(part[t] for part in observation)), state, bank, tape))
        state = decisions[-1].state
    guidance = Guidance(*map(torch.stack, zip(*(decision.guidance for decision in decisions), strict=True)))
    rollout = _rollout(torch.stack([decision.value for decision in decisions]))

    def differentiate() -> None:
        if not recorded:
            tape.rewind()
        differentiator.on_policy(rollout, observation, guidance, start, bank, tape)

    yield _contenders(name, differentiate, training_products(policy, steps, batch, recorded=recorded), config, seconds)


def _contenders(
    name: str, work: Callable[[], None], products: Sequence[Product], config: RunConfig, seconds: float
) -> Mapping[str, Contender]:
    """Return what measures frames per second of some work of a whole rollout, and of its products alone."""
    frames = config.rollout_steps * config.batch
    precisions: tuple[Precision, ...] = tuple(dict.fromkeys(("fp32", config.precision)))
    alone = {f"{name}, {precision} products": run_products(products, dtype_of(precision)) for precision in precisions}
    return {who: partial(_frames_per_second, run, frames, seconds) for who, run in ({name: work} | alone).items()}


def _frames_per_second(run: Callable[[], None], frames: int, seconds: float) -> float:
    return rate(run, seconds, core_seconds) * frames


def _rollout(values: torch.Tensor) -> Rollout:
    """Make up what happened at steps of which the critic said ``values``, [T, B]."""
    generator = torch.Generator().manual_seed(0)
    actions = torch.randint(len(Action), values.shape, generator=generator)
    return Rollout(
        actions=actions,
        rewards=torch.rand(values.shape, generator=generator) - 0.5,
        terminated=torch.zeros_like(actions, dtype=torch.bool),
        truncated=torch.zeros_like(actions, dtype=torch.bool),
        valid=torch.ones_like(actions, dtype=torch.bool),
        values=values,
        bootstrap=values[-1],
    )
