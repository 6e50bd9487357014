"""`hoz-dist bench policy`: frames that a policy acts in, and learns from, in a second."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Final

import torch

from hoz_dist.a3c.differentiation import Differentiator
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.bench.products import acting_products, run_products, training_products
from hoz_dist.bench.report import Metric
from hoz_dist.bench.samples import graph_bank, observations
from hoz_dist.bench.timing import Contender, Contest, Progress, rate, run_contests
from hoz_dist.config import RunConfig
from hoz_dist.nav.actions import Action
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.settings import Preset

ACTING_BATCHES: Final = (1, 64)
TRAINING_BATCHES: Final = (16, 64)
_UNIT: Final = "frames/s"


def bench_policy(
    presets: Sequence[Preset], *, steps: int, seconds: float, repeats: int, progress: Progress
) -> dict[str, Metric]:
    """Measure frames per second of method `hoz` in one thread; the limit is the matrix products alone, in float32.

    Acting is one step of B episodes. Training is the loss's gradient of a rollout of T steps of B episodes: with the
    forward pass; and without that of the LSTM, from what acting recorded of it, as actors do.

    Args:
        presets: Sizes of the network.
        steps: T.
        seconds: Length of one measurement.
        repeats: Measurements of each figure.
        progress: Told how far the work is.
    """
    torch.set_num_threads(1)
    contests: dict[str, Contest] = {}
    for preset in presets:
        for batch in ACTING_BATCHES:
            contests[f"policy_act_{preset}_b{batch}"] = partial(_acting, preset, batch, seconds)
        for batch in TRAINING_BATCHES:
            for kind in ("train", "train_recorded"):
                name = f"policy_{kind}_{preset}_b{batch}"
                contests[name] = partial(_training, preset, steps, batch, seconds, recorded=kind != "train")
    named = [partial(_named, name, contest) for name, contest in contests.items()]
    samples = run_contests(named, repeats, progress)
    return {name: Metric.of(samples[name], _UNIT, samples[f"{name}, products"]) for name in contests}


@contextmanager
def _named(name: str, contest: Contest) -> Iterator[Mapping[str, Contender]]:
    with contest() as contenders:
        yield {name: contenders["policy"], f"{name}, products": contenders["products"]}


@contextmanager
def _acting(preset: Preset, batch: int, seconds: float) -> Iterator[Mapping[str, Contender]]:
    config = RunConfig(preset=preset, batch=batch)
    policy, bank = make_policy(config.policy, config.seed), graph_bank(config.zones)
    observation, state = observations(config.policy, batch), policy.initial_state(batch)
    tape = policy.tape(1, batch)

    def act() -> None:
        nonlocal state
        tape.rewind()
        state = policy.act(observation, state, bank, tape).state

    with torch.no_grad():
        products = run_products(acting_products(policy, batch))
        yield {
            "policy": lambda: rate(act, seconds) * batch,
            "products": lambda: rate(products, seconds) * batch,
        }


@contextmanager
def _training(
    preset: Preset, steps: int, batch: int, seconds: float, *, recorded: bool
) -> Iterator[Mapping[str, Contender]]:
    config = RunConfig(preset=preset, batch=batch, rollout_steps=max(steps, 2))
    policy, bank = make_policy(config.policy, config.seed), graph_bank(config.zones)
    parameters = FlatParameters(policy)
    observation, start = observations(config.policy, steps, batch), policy.initial_state(batch)
    tape = policy.tape(steps, batch)
    state, decisions = start, []
    for t in range(steps):
        decisions.append(policy.act(Observation(*(part[t] for part in observation)), state, bank, tape))
        state = decisions[-1].state
    guidance = Guidance(*map(torch.stack, zip(*(decision.guidance for decision in decisions), strict=True)))
    values = torch.stack([decision.value for decision in decisions])
    rollout = _rollout(values)
    differentiator = Differentiator(config, policy, parameters)

    def differentiate() -> None:
        if not recorded:
            tape.rewind()
        differentiator.on_policy(rollout, observation, guidance, start, bank, tape)

    products = run_products(training_products(policy, steps, batch, recorded=recorded))
    yield {
        "policy": lambda: rate(differentiate, seconds) * steps * batch,
        "products": lambda: rate(products, seconds) * steps * batch,
    }


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
