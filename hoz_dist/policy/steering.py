"""Steerings: what may change the policy's logits after the LSTM, with a memory that lasts an episode.

A method that adapts while it acts (SAVN, TPN) has a `Steering`; `hoz_dist.policy.steerings` lists them. It gets what
`Moment` holds and returns `Steered`. One function serves both ways of running the network: `ActorCritic.act` calls it
for one step at a time (T = 1, without gradients), `ActorCritic.unroll` for a whole rollout (T steps, with gradients).
Both must say the same. `Steering.forward` sees to that for who implements `step` alone: it goes step by step and begins
every episode with the initial memory. Who overrides `forward` to do all steps at once must reset the memory himself.

What gradients do: inside a rollout they go through the memory from step to step, unless the steering detaches them, and
into the LSTM by way of outputs and logits. The memory before the rollout's first step has none (truncated
backpropagation, as for the LSTM), and what is kept after the last one is detached. A steering that needs gradients
while it acts (SAVN's inner step) writes them out, or computes them under ``torch.enable_grad()``: `act` runs without.

Imitation: a steering with ``imitates = True`` may return an `Imitation`: policies' logits, and at which steps they are
to be taught the actions that begin a shortest path. These are labels; they never reach the network. Who acts (an actor)
or learns (a learner from rollouts) looks them up in the rooms it holds (`hoz_dist.sim.expert`) and puts them into
`Rollout.expert`; `hoz_dist.a3c.loss` adds the cross-entropy with the weight ``RunConfig.imitation_weight``. That comes
besides the approach, which every policy is taught once the target was seen.

The value function stays as it is: no steering changes it.
"""

from typing import ClassVar, NamedTuple

import torch
from torch import Tensor, nn

Memory = tuple[Tensor, ...]
"""What a steering remembers of B episodes, each tensor [B, ...]; empty if it remembers nothing."""


class Moment(NamedTuple):
    """What a steering may look at, of T steps [T, B, ...]; `step` gets one step, [B, ...]."""

    logits: Tensor
    """Of the policy, after the done reminder if there is one, [T, B, 6]."""
    outputs: Tensor
    """Of the LSTM, [T, B, H]; the actor's inputs."""
    features: Tensor
    """Of the picture as the visual encoder gives them, which has no parameters that are trained, [T, B, C, G, G]."""
    previous_action: Tensor
    """As it was `hoz_dist.nav.feedback.felt`, int64 [T, B]; ``NO_ACTION`` at the first step of an episode."""
    first: Tensor
    """Whether the step begins an episode, bool [T, B]."""


class Imitation(NamedTuple):
    """What is to be taught the expert's action."""

    logits: Tensor
    """Of K policies that are taught at once, [T, B, K, 6], with gradient."""
    counts: Tensor
    """At which steps, bool [T, B]."""


class Steered(NamedTuple):
    """What a steering returns, [T, B, ...]; `step` returns one step, [B, ...]."""

    logits: Tensor
    """What is acted on, and what the policy's loss is computed from, [T, B, 6]."""
    memory: Memory
    """After the last step."""
    imitation: Imitation | None = None
    """None if nothing is to be imitated; the same for all steps."""


class Steering(nn.Module):
    """May change the logits at each step, and remembers what it likes for as long as an episode lasts.

    Subclasses implement `step`, and `initial_memory` if they have one.
    """

    imitates: ClassVar[bool] = False
    """Whether it returns an `Imitation`, so that the expert's actions have to be looked up."""

    def initial_memory(self, batch: int) -> Memory:
        """Return the memory before the first step of B episodes."""
        del batch
        return ()

    def step(self, moment: Moment, memory: Memory, actor: nn.Linear) -> Steered:
        """Take one step of B episodes.

        Args:
            moment: Of one step, [B, ...].
            memory: After the step before; the initial one where an episode begins.
            actor: The layer that made the logits from the outputs, before the done reminder.
        """
        raise NotImplementedError

    def forward(self, moment: Moment, memory: Memory, actor: nn.Linear) -> Steered:
        """Take T steps of B episodes.

        Args:
            moment: [T, B, ...].
            memory: After the step before the first one.
            actor: See `step`.
        """
        initial = self.initial_memory(moment.first.shape[1])
        steps = []
        for t, first in enumerate(moment.first):
            if first.any():
                memory = tuple(
                    torch.where(first.view(-1, *(1,) * (part.ndim - 1)), fresh, part)
                    for fresh, part in zip(initial, memory, strict=True)
                )
            steps.append(self.step(Moment._make(part[t] for part in moment), memory, actor))
            memory = steps[-1].memory
        taught = [one.imitation for one in steps if one.imitation is not None]
        return Steered(
            logits=torch.stack([one.logits for one in steps]),
            memory=memory,
            imitation=Imitation(*map(torch.stack, zip(*taught, strict=True))) if taught else None,
        )
