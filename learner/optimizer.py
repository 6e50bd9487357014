"""Adam on one flat vector of parameters, with a learning rate that falls linearly over the budget."""

from typing import Final, NamedTuple

import numpy as np
import torch
from torch.optim.adam import adam

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
        self._first_moment = torch.zeros_like(self._tensor)
        self._second_moment = torch.zeros_like(self._tensor)
        self._steps = torch.zeros(())

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

    @property
    def updates(self) -> int:
        """Number of gradients applied."""
        return int(self._steps.item())

    def set_progress(self, progress: float) -> None:
        """Set the learning rate to ``base * (1 - progress)``; progress is the share of the budget used."""
        self.learning_rate = self.base_learning_rate * (1.0 - min(max(progress, 0.0), 1.0))

    def step(self, gradient: Vector) -> None:
        """Apply one gradient.

        Args:
            gradient: [P], finite; left as it is, and may be read-only (the bytes of a message).
        """
        # The function behind `torch.optim.Adam`: the class spends a fifth of a small policy's step on its hooks.
        adam(
            [self._tensor],
            [borrowed(gradient)],
            [self._first_moment],
            [self._second_moment],
            max_exp_avg_sqs=[],
            state_steps=[self._steps],
            foreach=False,
            fused=True,
            amsgrad=False,
            beta1=BETAS[0],
            beta2=BETAS[1],
            lr=self.learning_rate,
            weight_decay=0.0,
            eps=EPSILON,
            maximize=False,
        )

    def state(self) -> AdamState:
        """Return a copy of the moments."""
        first, second = self._first_moment.numpy().copy(), self._second_moment.numpy().copy()
        return AdamState(int(self._steps.item()), first, second)

    def load_state(self, state: AdamState) -> None:
        """Continue from moments that `state` returned.

        Raises:
            ValueError: They belong to another number of parameters.
        """
        if not state.first_moment.size == state.second_moment.size == self.size:
            message = f"moments of {state.first_moment.size} parameters do not fit {self.size} parameters"
            raise ValueError(message)
        self._steps.fill_(state.steps)
        self._first_moment.copy_(borrowed(state.first_moment))
        self._second_moment.copy_(borrowed(state.second_moment))
