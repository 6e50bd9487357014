"""The steering of method `savn`: a learnt loss adapts the head within an episode [Wortsman et al. 2019].

After every k steps of an episode, the head takes a gradient step on a loss of the last k outputs and policies. That
loss needs no label and no reward, so it adapts in evaluation as it does in training. What it is, is learnt: the
gradient of the navigation loss goes through these steps (second order) to the learnt loss, the head and the outputs,
within a rollout; dW and outputs of the rollout before are constants.

Deviations:

- Only the head adapts; see `hoz_dist.policy.fast_weights` for why.
- The learnt loss slides along time, with units as channels, as the paper's words say. In the released code it slides
  along the units, with steps as channels, so that filters see a policy's entries together with three units at most.
  Outputs adapt there too; of a gradient by the head alone nearly nothing would depend on them.
- Its units are smooth (SiLU). Leaky ReLUs, as in the released code, have a slope that jumps, and so would the gradient
  step: the gradient through it knows nothing of that.
- The step size is learnt, as in Meta-SGD (Li et al. 2017); the released code has 1e-4, for all weights.
- The gradient stops where a rollout begins; the released code goes back through whole episodes, of at most 30 steps.
"""

import math
from typing import Final

import torch
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.nav.actions import Action
from hoz_dist.policy.fast_weights import change_of_logits, steps_before
from hoz_dist.policy.settings import PolicySettings
from hoz_dist.policy.steering import Memory, Moment, Steered, Steering

WINDOW: Final = 6
"""k, steps between adaptations, and how many of them the learnt loss sees."""
MOST_ADAPTATIONS: Final = 4
"""Adaptations in an episode, as in the released code; later steps keep what the last one made."""
FIRST_STEP_SIZE: Final = 0.5
"""alpha at the start; it changes logits by some hundredths then."""


class LearntAdaptation(Steering):
    """Adapts the head of each episode by a loss that is learnt.

    Args:
        settings: What shapes the network.
    """

    def __init__(self, settings: PolicySettings) -> None:
        super().__init__()
        self._outputs = settings.sizes.lstm
        self.loss = LearntLoss(self._outputs)
        self.log_step_size = nn.Parameter(torch.tensor(math.log(FIRST_STEP_SIZE)))

    def initial_memory(self, batch: int) -> Memory:
        """Return the number of steps made [B], the last k outputs [B, k, H], and dW [B, 6, H]."""
        return (
            torch.zeros(batch, dtype=torch.int64),
            torch.zeros(batch, WINDOW, self._outputs),
            torch.zeros(batch, len(Action), self._outputs),
        )

    def forward(self, moment: Moment, memory: Memory, actor: nn.Linear) -> Steered:
        """Take T steps of B episodes; all episodes' first adaptations in the rollout at once, then the second ones."""
        made, last, increments = memory
        steps = steps_before(made, moment.first)
        outputs = torch.cat([last.transpose(0, 1), moment.outputs])  # row t is k steps before step t
        due = (steps > 0) & (steps % WINDOW == 0) & (steps <= WINDOW * MOST_ADAPTATIONS)
        rounds = due.cumsum(dim=0)
        # An episode that has not adapted yet has no dW, whatever the one before it in its place has left.
        adapted = steps >= WINDOW
        logits = moment.logits
        for number in range(int(rounds[-1].max()) + 1):
            if number > 0:
                times, episodes = (due & (rounds == number)).nonzero(as_tuple=True)
                windows = outputs[times.unsqueeze(1) + torch.arange(WINDOW), episodes.unsqueeze(1)]
                again = steps[times, episodes] > WINDOW
                before = increments[episodes] * again.view(-1, 1, 1)
                increments = increments.index_put((episodes,), self._adapt(windows, before, actor))
            held = adapted & (rounds == number)
            logits = logits + change_of_logits(moment.outputs, increments) * held.unsqueeze(-1)
        return Steered(logits, (steps[-1] + 1, outputs[-WINDOW:].transpose(0, 1), increments))

    def _adapt(self, windows: Tensor, increments: Tensor, actor: nn.Linear) -> Tensor:
        """Take a gradient step of E episodes.

        Args:
            windows: Outputs of the last k steps, [E, k, H].
            increments: dW before, [E, 6, H].
            actor: The head.

        Returns:
            dW after, [E, 6, H].
        """
        policies = (actor(windows) + windows @ increments.mT).softmax(dim=-1)
        errors = self.loss.gradient(windows, policies)
        return increments - self.log_step_size.exp() * (errors.mT @ windows)


class LearntLoss(nn.Module):
    """L_phi of outputs h and policies pi at k steps: the norm of what two causal convolutions make of them.

    With x = [h, pi], and zeros for what was before the first step,

    - u_t = silu(W_1 [x_(t-1), x_t] + b_1), of ten filters,
    - y_t = w_2 [u_(t-2), u_t] + b_2,
    - L = |y|.

    Only its gradient is needed. It is written out: actors compute it at nearly every step, for a few episodes, and
    automatic differentiation takes twice as long.

    Args:
        outputs: H, the size of h.
    """

    FILTERS: Final = 10

    def __init__(self, outputs: int) -> None:
        super().__init__()
        self._inputs = outputs + len(Action)
        self.first = nn.Linear(2 * self._inputs, self.FILTERS)
        self.second = nn.Linear(2 * self.FILTERS, 1)

    def gradient(self, outputs: Tensor, policies: Tensor) -> Tensor:
        """Return the gradient of the loss by the logits of the policies, [E, k, 6]; itself differentiable.

        Args:
            outputs: h of E episodes at k steps, [E, k, H].
            policies: pi, probabilities of the actions, [E, k, 6].
        """
        filtered = self.first(_with_earlier(torch.cat([outputs, policies], dim=-1), 1))
        gates = filtered.sigmoid()
        result = self.second(_with_earlier(filtered * gates, 2))
        norm = (result.square().sum(dim=1, keepdim=True) + 1e-8).sqrt()  # never 0, where it has no gradient
        of_units = _from_later(result / norm * self.second.weight, 2)
        of_filtered = of_units * gates * (1.0 + filtered * (1.0 - gates))
        weights = self.first.weight.view(self.FILTERS, 2, self._inputs)[:, :, -len(Action) :]
        of_policies = _from_later(of_filtered @ weights.flatten(1), 1)
        return policies * (of_policies - (policies * of_policies).sum(dim=-1, keepdim=True))


def _with_earlier(sequence: Tensor, by: int) -> Tensor:
    """Put what was some steps earlier, zeros before the first, before each step: [E, k, F] becomes [E, k, 2 F]."""
    return torch.cat([functional.pad(sequence, (0, 0, by, 0))[:, :-by], sequence], dim=-1)


def _from_later(gradients: Tensor, by: int) -> Tensor:
    """Take gradients back through `_with_earlier`: [E, k, 2 F] becomes [E, k, F]."""
    earlier, same = gradients.chunk(2, dim=-1)
    return same + functional.pad(earlier[:, by:], (0, 0, 0, by))
