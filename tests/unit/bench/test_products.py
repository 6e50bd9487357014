import pytest
import torch
from torch import nn

from hoz_dist.bench.products import Product, acting_products, run_products, training_products
from hoz_dist.config import RunConfig
from hoz_dist.nav.categories import TARGETS
from hoz_dist.policy.actor_critic import ActorCritic
from hoz_dist.policy.parameters import make_policy


@pytest.fixture
def policy() -> ActorCritic:
    return make_policy(RunConfig().policy, 0)


def multiplications(products: list[Product]) -> int:
    return sum(p.rows * p.inner * p.columns * p.times * p.side_by_side for p in products)


def test_acting_multiplies_every_weight_once_for_each_episode(policy: ActorCritic) -> None:
    linear = sum(module.weight.numel() for module in policy.modules() if isinstance(module, nn.Linear))
    recurrent = sum(weight.numel() for weight in policy.lstm.recurrent_gates)
    categories, features, channels = len(TARGETS), policy.settings.sizes.objects, policy.settings.channels
    objects = 6 * categories**2 + 6 * categories * features + features * categories * (channels + 1)
    assert multiplications(acting_products(policy, 5)) == 5 * (linear + recurrent + objects)


def test_a_gradient_takes_two_products_back_for_each_one_forward(policy: ActorCritic) -> None:
    steps, batch = 4, 3
    forward = multiplications(acting_products(policy, batch)) * steps
    both = multiplications(training_products(policy, steps, batch, recorded=False))
    # Less what has no weights before it, and the step before the first one.
    assert 2.5 * forward < both < 3.0 * forward
    backward = multiplications(training_products(policy, steps, batch, recorded=True))
    assert both - forward < backward < both


def test_products_run(policy: ActorCritic) -> None:
    with torch.no_grad():
        run_products(training_products(policy, 2, 2, recorded=False))()
