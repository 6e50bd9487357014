"""Rolls the policy out in a batch of episodes and computes the gradient of the rollout."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hoz_dist.a3c.loss import Loss, LossWeights, a3c_loss
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.config import RunConfig
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.actor_critic import ActorCritic, Decision, State
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.sampling import sample_actions
from hoz_dist.sim.batch_env import BatchEnv


class Update(NamedTuple):
    """What came of one rollout."""

    gradient: NDArray[np.float32]
    """Gradient of the loss by the flat parameters, clipped, [P]; valid until the next call."""
    frames: int
    loss: Loss
    finished: list[EpisodeResult]


class Collector:
    """Owns the policy copy, the environment and the recurrent state of one actor.

    Attributes:
        parameters: The policy's parameters; load new ones between rollouts.
        bank: The scene graphs; put new ones between rollouts.
    """

    def __init__(self, config: RunConfig, env: BatchEnv, rng: np.random.Generator) -> None:
        self._config = config
        self._env = env
        self._rng = rng
        self._policy: ActorCritic = make_policy(config.policy, config.seed)
        self.parameters = FlatParameters(self._policy)
        self.bank = GraphBank(config.zones, config.edge_cost)
        self._state: State = self._policy.initial_state(config.batch)

    def roll_out(self) -> Update:
        """Run T steps in every episode, then go back over them once."""
        config, start = self._config, self._state
        views, observed, guidances, values, steps, actions = [], [], [], [], [], []
        finished: list[EpisodeResult] = []
        decision = self._decide()
        for _ in range(config.rollout_steps):
            views.append(self._env.views.copy())
            observed.append(self._observation)
            guidances.append(decision.guidance)
            values.append(decision.value)
            chosen = sample_actions(decision.logits, self._rng)
            step = self._env.step(chosen.numpy())
            actions.append(chosen)
            steps.append(step)
            finished += step.finished
            self._state = decision.state
            decision = self._decide()
        rollout = Rollout(
            actions=torch.stack(actions),
            rewards=_stack(step.reward for step in steps),
            terminated=_stack(step.terminated for step in steps),
            truncated=_stack(step.truncated for step in steps),
            valid=_stack(step.valid for step in steps),
            values=torch.stack(values),
            bootstrap=decision.value,
        )
        loss = self._differentiate(rollout, views, observed, guidances, start)
        return Update(self.parameters.gradients.numpy(), rollout.frames, loss, finished)

    def _decide(self) -> Decision:
        self._observation = self._env.observe()
        return self._policy.act(self._observation, self._state, self.bank)

    def _differentiate(
        self,
        rollout: Rollout,
        views: list[NDArray[np.int64]],
        observed: list[Observation],
        guidances: list[Guidance],
        start: State,
    ) -> Loss:
        config = self._config
        observation = self._env.gather(
            np.stack(views),
            *(np.stack(arrays) for arrays in zip(*(o[3:] for o in observed), strict=True)),
        )
        guidance = Guidance(*map(torch.stack, zip(*guidances, strict=True)))
        unrolled = self._policy.unroll(observation, start, guidance, self.bank)
        weights = LossWeights(
            discount=config.discount,
            gae_lambda=config.gae_lambda,
            value=config.value_weight,
            entropy=config.entropy_weight,
            scene=config.scene_weight,
        )
        scenes = torch.from_numpy(observation.scene)
        loss = a3c_loss(rollout, unrolled.logits, unrolled.values, weights, unrolled.scene_logits, scenes)
        self.parameters.gradients.zero_()
        loss.total.backward()  # type: ignore[no-untyped-call]
        clip_norm(self.parameters.gradients, config.gradient_norm)
        return loss


def clip_norm(gradient: Tensor, largest: float) -> None:
    """Scale a gradient down in place if its Euclidean norm is above ``largest``."""
    norm = float(gradient.norm())
    if norm > largest:
        gradient.mul_(largest / norm)


def _stack(arrays: Iterable[NDArray[np.generic]]) -> Tensor:
    return torch.from_numpy(np.stack(list(arrays)))
