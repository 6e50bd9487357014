"""Adam on one flat vector of parameters, with a learning rate that falls linearly over the budget."""

from typing import Final, NamedTuple

import numpy as np
import torch

from hoz_dist.a3c.compression.borrowing import borrowed
from hoz_dist.gradient_forms import Vector

BETAS: Final = (0.9, 0.999)
EPSILON: Final = 1e-8
NORM_TOLERANCE: Final = 1e-3
"""Actors clip their gradients; a norm that exceeds the bound by no more than this share is their rounding."""


class AdamState(NamedTuple):
    """What Adam remembers between steps; together with the parameters all that a resumed run needs."""

    steps: int
    first_moment: Vector
    """Running mean of the gradient, [P]."""
    second_moment: Vector
    """Running mean of the squared gradient, [P]."""


def lag_weight(lag: int) -> float:
    """Return the factor of a gradient that was computed ``lag`` versions ago, 1 / sqrt(1 + lag); exactly 1 at lag 0.

    The factor scales the gradient, not the learning rate. Adam divides by the running magnitude of the gradients, so
    only a gradient's weight relative to the others counts: actors that all lag alike train at the full learning rate,
    and a straggler moves the parameters less than its fresher fellows. Dividing the learning rate by the lag, as in
    staleness-aware SGD [Zhang et al. 2016], would slow down every run with many actors.
    """
    return float(1.0 / np.sqrt(1.0 + lag))


class FlatAdam:
    """Adam (fused: one pass over memory) that owns the parameters.

    Args:
        parameters: Initial parameters, float32 [P]; copied.
        learning_rate: The learning rate at progress 0.
    """

    def __init__(self, parameters: Vector, learning_rate: float) -> None:
        self.base_learning_rate = learning_rate
        self.learning_rate = learning_rate
        # The NumPy arrays and the tensors are two views of the same memory.
        self._parameters = np.array(parameters, dtype=np.float32)
        self._tensor = torch.from_numpy(self._parameters)
        self._weighted = torch.zeros_like(self._tensor)
        self._adam = torch.optim.Adam([self._tensor], lr=learning_rate, betas=BETAS, eps=EPSILON, fused=True)

    @property
    def size(self) -> int:
        """P, the number of parameters."""
        return self._parameters.size

    @property
    def parameters(self) -> Vector:
        """The parameters as they are now, [P]: a view that the next step changes. Copy it to keep it."""
        view = self._parameters.view()
        view.flags.writeable = False
        return view

    @property
    def tensor(self) -> torch.Tensor:
        """The parameters, [P], where the next step changes them."""
        return self._tensor

    def set_progress(self, progress: float) -> None:
        """Set the learning rate to ``base * (1 - progress)``; progress is the share of the budget used."""
        self.learning_rate = self.base_learning_rate * (1.0 - min(max(progress, 0.0), 1.0))

    def step(self, gradient: Vector, weight: float = 1.0) -> None:
        """Apply one gradient.

        Args:
            gradient: [P], finite; left as it is, and may be read-only (the bytes of a message).
            weight: Its factor, see `lag_weight`.
        """
        received = borrowed(gradient)
        # A gradient of full weight is read where it is: the step writes into it only when told to scale it.
        self._tensor.grad = received if weight == 1.0 else torch.mul(received, weight, out=self._weighted)
        self._adam.param_groups[0]["lr"] = self.learning_rate
        self._adam.step()
        self._tensor.grad = None  # lets go of the message that it may be in

    def state(self) -> AdamState:
        """Return a copy of the moments."""
        state = self._adam.state.get(self._tensor)
        if state is None:
            return AdamState(0, np.zeros_like(self._parameters), np.zeros_like(self._parameters))
        first, second = state["exp_avg"], state["exp_avg_sq"]
        return AdamState(int(state["step"].item()), first.numpy().copy(), second.numpy().copy())

    def load_state(self, state: AdamState) -> None:
        """Continue from moments that `state` returned.

        Raises:
            ValueError: They belong to another number of parameters.
        """
        if not state.first_moment.size == state.second_moment.size == self.size:
            message = f"moments of {state.first_moment.size} parameters do not fit {self.size} parameters"
            raise ValueError(message)
        self._adam.state[self._tensor] = {
            "step": torch.tensor(float(state.steps), dtype=torch.float32),
            "exp_avg": torch.from_numpy(np.array(state.first_moment, dtype=np.float32)),
            "exp_avg_sq": torch.from_numpy(np.array(state.second_moment, dtype=np.float32)),
        }
