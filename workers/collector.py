"""Rolls the policy out in a batch of episodes and computes the gradient of the rollout."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hoz_dist.a3c.differentiation import Differentiator
from hoz_dist.a3c.loss import Loss
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.config import RunConfig
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import SCENES
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.actor_critic import ActorCritic, State
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.sampling import sample_actions
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.stages import StageClock


class Update(NamedTuple):
    """What came of one rollout."""

    gradient: NDArray[np.float32]
    """Gradient of the loss by the flat parameters, clipped, [P]; valid until the next call."""
    frames: int
    loss: Loss
    finished: list[EpisodeResult]


class Collector:
    """Owns the policy copy, the environment and the recurrent state of one actor.

    Args:
        config: Configuration of the run.
        env: Environment of ``config.batch`` episodes, with at least one room before the first rollout.
        rng: Source of the actions.
        clock: Measures how long the way back over a rollout takes.

    Attributes:
        parameters: The policy's parameters; load new ones between rollouts.
    """

    def __init__(
        self, config: RunConfig, env: BatchEnv, rng: np.random.Generator, clock: StageClock | None = None
    ) -> None:
        self._config = config
        self._env = env
        self._rng = rng
        self._clock = clock or StageClock()
        self._policy: ActorCritic = make_policy(config.policy, config.seed)
        self.parameters = FlatParameters(self._policy)
        self._differentiator = Differentiator(config, self._policy, self.parameters)
        self._bank = GraphBank(config.zones, config.edge_cost)
        self._state: State = self._policy.initial_state(config.batch)

    def use_graph(self, graph: SceneGraph) -> None:
        """Use a scene graph from the next step on.

        Episodes that hold a copy of the scene's earlier graph copy this one anew: merging another room may have
        numbered the zones otherwise.

        Raises:
            ValueError: The graph has other zones or categories.
        """
        self._bank.put(graph)
        zone = self._state.zone
        stale = zone.scene == SCENES.index(graph.scene)
        self._state = self._state._replace(zone=zone._replace(scene=zone.scene.masked_fill(stale, -1)))

    def roll_out(self) -> Update:
        """Run T steps in every episode, then go back over them once.

        Raises:
            InvalidValueError: The environment has no rooms.
        """
        start = self._state
        observations, decisions, actions, steps = [], [], [], []
        finished: list[EpisodeResult] = []
        for _ in range(self._config.rollout_steps):
            observation = self._env.observe()
            decision = self._policy.act(observation, self._state, self._bank)
            chosen = sample_actions(decision.logits, self._rng)
            step = self._env.step(chosen.numpy())
            observations.append(observation)
            decisions.append(decision)
            actions.append(chosen)
            steps.append(step)
            finished += step.finished
            self._state = decision.state
        bootstrap = self._policy.act(self._env.observe(), self._state, self._bank).value
        rollout = Rollout(
            actions=torch.stack(actions),
            rewards=_stack(step.reward for step in steps),
            terminated=_stack(step.terminated for step in steps),
            truncated=_stack(step.truncated for step in steps),
            valid=_stack(step.valid for step in steps),
            values=torch.stack([decision.value for decision in decisions]),
            bootstrap=bootstrap,
        )
        observation = Observation(*map(np.stack, zip(*observations, strict=True)))
        guidance = Guidance(*map(torch.stack, zip(*(decision.guidance for decision in decisions), strict=True)))
        with self._clock("differentiate"):
            loss = self._differentiator.on_policy(rollout, observation, guidance, start, self._bank)
        return Update(self.parameters.gradients.numpy(), rollout.frames, loss, finished)


def _stack(arrays: Iterable[NDArray[np.generic]]) -> Tensor:
    return torch.from_numpy(np.stack(list(arrays)))
