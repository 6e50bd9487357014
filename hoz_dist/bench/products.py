"""The matrix products that a policy cannot do without, and how fast they run alone: the limit of its speed.

A layer of weights W makes one product with its inputs going forward, and two going back: one for the gradient of W, one
for that of the inputs. All steps of a rollout go through a layer in one product, except through the recurrent weights
of the LSTM, whose input is the step before. Everything else (gates, losses, scene graphs) costs time but is no product.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn

from hoz_dist.bench.samples import graph_bank, observations
from hoz_dist.policy.actor_critic import ActorCritic
from hoz_dist.policy.layers import DETECTION_FEATURES, ObjectLayer
from hoz_dist.policy.navigator import Guidance


class Product(NamedTuple):
    """Products of [rows, inner] by [inner, columns]."""

    rows: int
    inner: int
    columns: int
    times: int = 1
    """So many one after the other, each of which needs the one before."""
    side_by_side: int = 1
    """So many independent ones at once."""


class _Layer(NamedTuple):
    """A layer of weights, and what passes through it."""

    rows: int
    """Rows of its input for each frame."""
    inputs: int
    outputs: int
    has_upstream: bool
    """Whether there are weights before it, so that its inputs have a gradient."""


def acting_products(policy: ActorCritic, batch: int) -> list[Product]:
    """Return the products of one step of B episodes."""
    return _forward(policy, 1, batch)


def training_products(policy: ActorCritic, steps: int, batch: int, *, recorded: bool) -> list[Product]:
    """Return the products of the gradient of a rollout of T steps of B episodes.

    Args:
        policy: The policy.
        steps: T.
        batch: B.
        recorded: What the LSTM computes going forward is known already.
    """
    forward = _around_lstm(policy, steps * batch) if recorded else _forward(policy, steps, batch)
    return forward + _backward(policy, steps, batch)


def run_products(products: Sequence[Product], dtype: torch.dtype = torch.float32) -> Callable[[], None]:
    """Return what runs products of some type, each with operands and results of its own."""
    ready = [(*_operands(product, dtype), product.times) for product in products]

    def run() -> None:
        for a, b, out, times in ready:
            multiply = torch.mm if a.ndim == 2 else torch.bmm  # noqa: PLR2004 - a matrix has two axes
            for _ in range(times):
                multiply(a, b, out=out)

    return run


def _operands(product: Product, dtype: torch.dtype) -> tuple[Tensor, Tensor, Tensor]:
    lead = () if product.side_by_side == 1 else (product.side_by_side,)
    return (
        torch.randn(*lead, product.rows, product.inner, dtype=dtype),
        torch.randn(*lead, product.inner, product.columns, dtype=dtype),
        torch.empty(*lead, product.rows, product.columns, dtype=dtype),
    )


def _forward(policy: ActorCritic, steps: int, batch: int) -> list[Product]:
    gates = 4 * policy.lstm.cells
    inputs = [Product(steps * batch, layer.inputs, layer.outputs) for layer in _input_gates(policy)]
    steps_through = [Product(batch, policy.lstm.cells, gates, times=steps) for _ in policy.lstm.recurrent_gates]
    return _around_lstm(policy, steps * batch) + inputs + steps_through


def _around_lstm(policy: ActorCritic, frames: int) -> list[Product]:
    """Return the products going forward before and behind the LSTM."""
    layers = _linear_layers(policy)
    products = [Product(layer.rows * frames, layer.inputs, layer.outputs) for layer in layers]
    return products + _object_products(policy, frames)


def _backward(policy: ActorCritic, steps: int, batch: int) -> list[Product]:
    frames, products = steps * batch, []
    for rows, inputs, outputs, has_upstream in [*_linear_layers(policy), *_input_gates(policy)]:
        products.append(Product(outputs, rows * frames, inputs))
        if has_upstream:
            products.append(Product(rows * frames, outputs, inputs))
    cells = policy.lstm.cells
    gates = 4 * cells
    for _ in policy.lstm.recurrent_gates:
        if steps > 1:
            products.append(Product(batch, gates, cells, times=steps - 1))
        products.append(Product(gates, frames, cells))
    for product in _object_products(policy, frames):
        # As of any product A B = C: the gradients of A and of B from that of C.
        products.append(product._replace(inner=product.columns, columns=product.inner))
        products.append(product._replace(rows=product.inner, inner=product.rows))
    return products


def _linear_layers(policy: ActorCritic) -> list[_Layer]:
    """Find the linear layers outside the LSTM, by watching what passes through them."""
    found: list[_Layer] = []

    def watch(module: nn.Module, inputs: tuple[Any, ...], output: Any) -> None:
        del output
        assert isinstance(module, nn.Linear)  # noqa: S101 - only those are watched
        rows = inputs[0].numel() // module.in_features
        found.append(_Layer(rows, module.in_features, module.out_features, inputs[0].requires_grad))

    watched = [module for module in policy.modules() if isinstance(module, nn.Linear)]
    hooks = [module.register_forward_hook(watch) for module in watched]
    guidance = Guidance(*(part.unsqueeze(0) for part in Guidance.nothing(1)))
    bank = graph_bank(policy.settings.zones)
    policy.unroll(observations(policy.settings, 1, 1), policy.initial_state(1), guidance, bank)
    for hook in hooks:
        hook.remove()
    return found


def _input_gates(policy: ActorCritic) -> list[_Layer]:
    cells = policy.lstm.cells
    sizes = [policy.trunk.features, *(cells for _ in policy.lstm.recurrent_gates)]
    return [_Layer(1, inputs, 4 * cells, has_upstream=True) for inputs in sizes[:-1]]


def _object_products(policy: ActorCritic, frames: int) -> list[Product]:
    """Return the products A X_o, (A X_o) W_o and H_o' f^v [Eq. 6]."""
    layer = policy.object_branch
    if not isinstance(layer, ObjectLayer):
        return []
    categories, features = len(layer.adjacency), layer.weight.shape[1]
    channels = policy.settings.channels
    return [
        Product(DETECTION_FEATURES * frames, categories, categories),
        Product(categories * frames, DETECTION_FEATURES, features),
        Product(features, categories, channels + 1, side_by_side=frames),
    ]
