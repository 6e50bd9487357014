"""Steerings made for tests."""

from dataclasses import replace
from typing import Any, cast

import pytest
import torch
from torch import nn

from hoz_dist.policy.methods import METHODS
from hoz_dist.policy.methods.description import Layer
from hoz_dist.policy.settings import PolicySettings
from hoz_dist.policy.steering import Imitation, Memory, Moment, Steered, Steering
from hoz_dist.policy.steerings import STEERINGS


class CountingSteering(Steering):
    """Does a little of all that a steering may do.

    Remembers the number of steps and the sum of the weighted outputs; imitates but for every fifth step.
    """

    imitates = True

    def __init__(self, settings: PolicySettings) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.linspace(-0.01, 0.01, settings.sizes.lstm))

    def initial_memory(self, batch: int) -> Memory:
        return torch.zeros(batch, dtype=torch.int64), torch.zeros(batch, 1)

    def step(self, moment: Moment, memory: Memory, actor: nn.Linear) -> Steered:
        steps, total = memory[0] + 1, memory[1] + moment.outputs @ self.weight[:, None]
        logits = moment.logits + total * actor.weight.sum(dim=1)
        return Steered(logits, (steps, total), Imitation(logits.unsqueeze(1), steps % 5 != 0))


class ImitatingSteering(Steering):
    """Has the policy itself imitate, at every step."""

    imitates = True

    def __init__(self, settings: PolicySettings) -> None:
        del settings
        super().__init__()

    def step(self, moment: Moment, memory: Memory, actor: nn.Linear) -> Steered:
        del actor
        return Steered(moment.logits, memory, Imitation(moment.logits.unsqueeze(1), torch.ones_like(moment.first)))


def steer_a3c(monkeypatch: pytest.MonkeyPatch, kind: type[Steering]) -> None:
    """Let method `a3c` have a steering for the rest of a test."""
    layer: Any = "of_a_test"
    monkeypatch.setitem(cast(dict[Layer, type[Steering]], STEERINGS), layer, kind)
    monkeypatch.setitem(METHODS, "a3c", replace(METHODS["a3c"], layers=(layer,)))
