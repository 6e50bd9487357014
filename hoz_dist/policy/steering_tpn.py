"""The steering of methods with TPN, the tentative policy network [Du et al. 2020].

An agent that comes back to a view that it has had in the episode is in a deadlock: it turns to and fro, or walks into a
wall. A memory of the last steps tells. Of what the agent did in states like the one it is in, TPN makes a tentative
policy, which is a pseudo-label: the head takes a gradient step towards it, in evaluation as in training.

Both the policy and TPN are taught the expert's actions in deadlocks (the paper's trial-driven imitation learning), TPN
there alone, the policy also once the target was seen, as with every method. Neither sees them: in evaluation there are
none.

We had the paper's abstract and its authors' code, ECCV-VN, to go by. Deviations from the code:

- What tells a deadlock is the picture, as an agent has nothing else; the code compares poses, which it is told by the
  simulator, in evaluation too.
- Labels are the expert's actions where the agent is, any of which will do; the code's is one of where it comes next.
- Only the head adapts; see `hoz_dist.policy.fast_weights` for why. It keeps what it learnt until the episode ends; the
  code forgets it after every 50 steps.
- It adapts before it acts, so that the pseudo-label counts where it was made; in the code it counts from the next step.
- With the done reminder of HOZ, what the head has adapted by is added after it; see `hoz_dist.policy.fast_weights`.
- The pseudo-label is TPN's distribution; the code takes its likeliest action, which would have a TPN that knows nothing
  yet drive an agent always the same way.
- The policy learns together with TPN, and with the adaptation; the code trains the policy first, then TPN, and adapts
  in evaluation alone. Gradients do not go through the adaptation, but for its step size, which is learnt (the code has
  1e-4, for all weights). As in the code, no gradient of TPN reaches the rest of the network.
- The memory is one of 50 steps, all of which are attended to; the code remembers all steps and attends to ten.
- States and layers are smaller, without residual blocks and layer norms.
"""

import math
from typing import Final

import torch
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.nav.actions import Action
from hoz_dist.nav.feedback import PREVIOUS_ACTIONS
from hoz_dist.policy.fast_weights import change_of_logits, steps_before
from hoz_dist.policy.settings import PolicySettings
from hoz_dist.policy.steering import Imitation, Memory, Moment, Steered, Steering

REMEMBERED: Final = 50
"""M, steps of the episode that are remembered."""
KEY: Final = 16
"""D, numbers that stand for a picture: enough for distances to be about those of the pictures."""
SAME: Final = 1e-3
"""Largest distance of two keys, relative to their length, of what counts as the same view.

In a kitchen, a living room and a bathroom, with the encoder `pooled`, 0.7 to 2.6% of the poses share a view with
another; a tenth or ten times as much makes it 0.7 to 3.1%.
"""
FIRST_STEP_SIZE: Final = 4.0
"""alpha at the start, times H; an adaptation then changes logits by some tenths where the policy is far from TPN's."""


class TentativePolicy(Steering):
    """Remembers an episode, and has the head follow a tentative policy where the agent is in a deadlock.

    Args:
        settings: What shapes the network.
    """

    imitates = True

    def __init__(self, settings: PolicySettings) -> None:
        super().__init__()
        sizes = settings.sizes
        self._outputs, self._features = sizes.lstm, sizes.tentative
        self.state = nn.Linear(sizes.lstm, sizes.tentative)
        self.hidden = nn.Linear(2 * sizes.tentative + PREVIOUS_ACTIONS, 2 * sizes.tentative)
        self.propose = nn.Linear(2 * sizes.tentative, len(Action))
        self.log_step_size = nn.Parameter(torch.tensor(math.log(FIRST_STEP_SIZE / sizes.lstm)))
        # Not learnt: a view keeps its key when the parameters change, which they do within episodes.
        length = settings.channels * settings.grid**2
        directions = torch.randn(length, KEY, generator=torch.Generator().manual_seed(0)) / KEY**0.5
        self.register_buffer("directions", directions, persistent=False)
        with torch.no_grad():
            self.propose.weight.mul_(0.1)  # start near the uniform policy, as the actor does
            self.propose.bias.zero_()

    def initial_memory(self, batch: int) -> Memory:
        """Return what is known of B episodes.

        Returns:
            The number of steps made [B]; of each of the last M steps the key [B, M, D], the state [B, M, S], and the
            action before it, one-hot [B, M, 9]; and dW [B, 6, H].
        """
        return (
            torch.zeros(batch, dtype=torch.int64),
            torch.zeros(batch, REMEMBERED, KEY),
            torch.zeros(batch, REMEMBERED, self._features),
            torch.zeros(batch, REMEMBERED, PREVIOUS_ACTIONS),
            torch.zeros(batch, len(Action), self._outputs),
        )

    def forward(self, moment: Moment, memory: Memory, actor: nn.Linear) -> Steered:
        """Take T steps of B episodes: all at once, but for what adaptations owe to those before."""
        del actor
        made, keys, states, actions, increments = memory
        steps = steps_before(made, moment.first)
        outputs = moment.outputs.detach()
        keys = torch.cat([keys, self._keys(moment.features).transpose(0, 1)], dim=1)
        states = torch.cat([states, functional.relu(self.state(outputs)).transpose(0, 1)], dim=1)
        actions = torch.cat([actions, functional.one_hot(moment.previous_action.t(), PREVIOUS_ACTIONS).float()], dim=1)
        remembered = _remembered(steps)
        stuck = (remembered & _alike(keys)).any(dim=-1)
        proposed = self._propose(states, actions, remembered).transpose(0, 1)
        change, increments = self._adapt(moment.logits, outputs, proposed, stuck, steps, increments)
        return Steered(
            logits=moment.logits + change,
            memory=(
                steps[-1] + 1,
                keys[:, -REMEMBERED:],
                states[:, -REMEMBERED:],
                actions[:, -REMEMBERED:],
                increments,
            ),
            imitation=Imitation(torch.stack([moment.logits, proposed], dim=2), stuck.t()),
        )

    def _keys(self, features: Tensor) -> Tensor:
        """Return what stands for pictures [T, B, C, G, G], [T, B, D]: a random projection."""
        return features.flatten(2) @ self.get_buffer("directions")

    def _propose(self, states: Tensor, actions: Tensor, remembered: Tensor) -> Tensor:
        """Return the logits of the tentative policy at the last T of M + T steps, [B, T, 6].

        Args:
            states: [B, M + T, S].
            actions: The one before each step, one-hot [B, M + T, 9].
            remembered: What each of T steps remembers of all, bool [B, T, M + T].
        """
        here = states[:, REMEMBERED:]
        scores = here @ states.mT / math.sqrt(self._features)
        weights = scores.masked_fill(~remembered, -1e9).softmax(dim=-1) * remembered
        # What was done at a step comes before the next one; no step remembers the last one.
        done = weights[..., :-1] @ actions[:, 1:]
        hidden = functional.relu(self.hidden(torch.cat([here, weights @ states, done], dim=-1)))
        return self.propose(hidden)  # type: ignore[no-any-return]

    def _adapt(
        self, logits: Tensor, outputs: Tensor, proposed: Tensor, stuck: Tensor, steps: Tensor, increments: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Take a gradient step of the cross-entropy with the tentative policy at each step that is in a deadlock.

        Args:
            logits: Of the policy, [T, B, 6].
            outputs: Of the LSTM, [T, B, H].
            proposed: Logits of the tentative policy, [T, B, 6].
            stuck: Whether the step is in a deadlock, bool [B, T].
            steps: Before each step, [T, B].
            increments: dW before the first step, [B, 6, H].

        Returns:
            What is added to the logits, [T, B, 6], and dW after the last step, [B, 6, H].
        """
        size = self.log_step_size.exp()
        carried_on = (steps > torch.arange(len(steps)).unsqueeze(1)).unsqueeze(-1)  # since before the first step
        carried = change_of_logits(outputs, increments) * carried_on
        flat = outputs.transpose(0, 1)  # [B, T, H]
        own = _of_episode(steps)
        kernel = flat @ flat.mT * own  # h_s . h_t of the steps s of t's episode up to t, [B, T, T]
        with torch.no_grad():
            errors = _errors(
                (logits + carried).transpose(0, 1), proposed.softmax(dim=-1).transpose(0, 1), size * kernel, stuck
            )
        change = carried + size * (kernel @ errors).transpose(0, 1)
        last = (errors * own[:, -1].unsqueeze(-1)).mT @ flat
        return change, increments * carried_on[-1].unsqueeze(-1) + size * last


def _remembered(steps: Tensor) -> Tensor:
    """Return which of M + T steps each of the last T remembers: those of its episode, no more than M.

    Args:
        steps: How many the episode has made before each of the T steps, [T, B].

    Returns:
        bool [B, T, M + T].
    """
    count = len(steps)
    ages = REMEMBERED + torch.arange(count).unsqueeze(1) - torch.arange(REMEMBERED + count)
    return (ages >= 1) & (ages <= REMEMBERED) & (ages <= steps.t().unsqueeze(-1))


def _of_episode(steps: Tensor) -> Tensor:
    """Return which of T steps belong to the episode of each, up to itself, bool [B, T, T]; `steps` as above."""
    order = torch.arange(len(steps))
    ages = order.unsqueeze(1) - order
    return (ages >= 0) & (ages <= steps.t().unsqueeze(-1))


def _alike(keys: Tensor) -> Tensor:
    """Return whether the last T of M + T views [B, M + T, D] are the same as each, bool [B, T, M + T]."""
    here = keys[:, REMEMBERED:]
    # Differences of squares, which are quicker, would round away what counts.
    distances = torch.cdist(here, keys, compute_mode="donot_use_mm_for_euclid_dist")
    return distances <= SAME * torch.linalg.vector_norm(here, dim=-1, keepdim=True)  # type: ignore[no-any-return]


def _errors(logits: Tensor, targets: Tensor, kernel: Tensor, stuck: Tensor) -> Tensor:
    """Return the downward gradients of the cross-entropies by the logits, each after the adaptations before it.

    Args:
        logits: Before the first adaptation, [B, T, 6].
        targets: Pseudo-labels, [B, T, 6].
        kernel: How an adaptation at s changes logits at t, [B, T, T].
        stuck: Where to adapt, bool [B, T].

    Returns:
        [B, T, 6]; 0 where nothing adapts.
    """
    errors = torch.zeros_like(logits)
    for t in stuck.any(dim=0).nonzero().flatten().tolist():
        now = logits[:, t] + (kernel[:, t, None, :t] @ errors[:, :t]).squeeze(1)
        errors[:, t] = (targets[:, t] - now.softmax(dim=-1)) * stuck[:, t, None]
    return errors
