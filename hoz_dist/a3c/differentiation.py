"""From a rollout to the gradient of its loss by the flat parameters."""

from functools import cached_property
from typing import NamedTuple

import torch
from torch import Tensor

from hoz_dist.a3c.loss import Loss, LossWeights, a3c_loss
from hoz_dist.a3c.norm import clip_norm
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.config import RunConfig
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.actor_critic import ActorCritic
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters
from hoz_dist.policy.state import State, Unrolled
from hoz_dist.policy.tape import Tape


class Behaviour(NamedTuple):
    """What another policy did in T steps of B episodes; see `Rollout` for autoreset."""

    actions: Tensor
    """int64 [T, B]."""
    rewards: Tensor
    """float32 [T, B]."""
    terminated: Tensor
    """Whether the episode ended by itself at the step, bool [T, B]."""
    truncated: Tensor
    """Whether the episode was cut off at the step, bool [T, B]."""
    valid: Tensor
    """Whether the action was taken, and is to be learnt from, bool [T, B]."""
    log_probabilities: Tensor
    """Log-probabilities of the actions under that policy, float32 [T, B]."""
    taken: int | None = None
    """Number of actions taken; see `Rollout`."""
    expert: Tensor | None = None
    """Which actions begin a shortest path, bool [T, B, 6]; see `Rollout`."""


class Differentiator:
    """Computes gradients of rollouts; each replaces the one before.

    Args:
        config: Configuration of the run: the loss's weights, and the largest norm of a gradient.
        policy: The network.
        parameters: Its flat parameters, which get the gradients.
    """

    def __init__(self, config: RunConfig, policy: ActorCritic, parameters: FlatParameters) -> None:
        self._policy = policy
        self._parameters = parameters
        self._largest_norm = config.gradient_norm
        self._size = config.rollout_steps, config.batch
        self._approach_weight = config.approach_weight_at
        self._weights = LossWeights(
            discount=config.discount,
            gae_lambda=config.gae_lambda,
            value=config.value_weight,
            entropy=config.entropy_weight,
            scene=config.scene_weight,
            imitation=config.imitation_weight,
        )

    def on_policy(
        self,
        rollout: Rollout,
        observation: Observation,
        guidance: Guidance,
        start: State,
        bank: GraphBank,
        tape: Tape | None = None,
        version: int = 0,
    ) -> Loss:
        """Compute the gradient of a rollout that was acted on the parameters as they are.

        Args:
            rollout: T steps of B episodes.
            observation: What was observed, [T, B, ...].
            guidance: What was decided besides the actions, [T, B].
            start: State before the first step.
            bank: The scene graphs that were used.
            tape: What acting has recorded of the steps; see `ActorCritic.unroll`.
            version: Of the parameters; the weight of what is imitated depends on it.
        """
        unrolled = self._policy.unroll(observation, start, guidance, bank, tape)
        return self._descend(rollout, unrolled, observation, version)

    def off_policy(
        self,
        behaviour: Behaviour,
        observation: Observation,
        guidance: Guidance,
        start: State,
        bank: GraphBank,
        version: int = 0,
    ) -> tuple[Loss, State]:
        """Compute the gradient of a rollout that was acted on other parameters.

        Args:
            behaviour: T steps of B episodes, as many as in the configuration.
            observation: What was observed at them, and after the last one, [T + 1, B, ...].
            guidance: What was decided besides the actions, [T + 1, B].
            start: State before the first step.
            bank: The scene graphs that were used.
            version: Of the parameters that acted; the weight of what is imitated depends on it.

        Returns:
            The loss, and the state of these parameters after the last step.
        """
        steps = len(behaviour.actions)
        seen, after = (Observation._make(part[rows] for part in observation) for rows in _split(steps))
        guided, guided_after = (Guidance._make(part[rows] for part in guidance) for rows in _split(steps))
        self._tape.rewind()
        unrolled = self._policy.unroll(seen, start, guided, bank, self._tape)
        # One step is taken in full precision, as an actor takes it: copying the weights would cost more than it saves.
        step = self._policy.lstm.tape(1, behaviour.actions.shape[1])
        with torch.no_grad():
            bootstrap = self._policy.unroll(after, unrolled.state, guided_after, bank, step).values[0]
        rollout = Rollout(
            **behaviour._asdict(),
            values=unrolled.values.detach(),
            bootstrap=bootstrap,
        )
        return self._descend(rollout, unrolled, seen, version), unrolled.state

    @cached_property
    def _tape(self) -> Tape:
        """Memory for rollouts that were not recorded when they were acted."""
        return self._policy.tape(*self._size)

    def _descend(self, rollout: Rollout, unrolled: Unrolled, observation: Observation, version: int) -> Loss:
        """Compute the loss and its gradient, clipped."""
        scenes = torch.from_numpy(observation.scene)
        weights = self._weights._replace(approach=self._approach_weight(version))
        loss = a3c_loss(
            rollout,
            unrolled.logits,
            unrolled.values,
            weights,
            unrolled.scene_logits,
            scenes,
            unrolled.imitation,
            unrolled.target_seen,
        )
        self._parameters.gradients.zero_()
        loss.total.backward()  # type: ignore[no-untyped-call]
        clip_norm(self._parameters.gradients, self._largest_norm)
        return loss


def _split(steps: int) -> tuple[slice, slice]:
    """Return the rows of the steps, and of what follows them."""
    return slice(steps), slice(steps, steps + 1)
