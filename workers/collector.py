"""Rolls the policy out in a batch of episodes; makes gradients of the rollouts, or messages."""

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
from hoz_dist.policy.actor_critic import ActorCritic
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.sampling import sample_actions
from hoz_dist.policy.state import State
from hoz_dist.policy.tape import Tape
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.expert import ExpertTable
from hoz_dist.stages import StageClock
from hoz_dist.wire.protocol.trajectories import Flag, RoomUsed, Steps
from workers.recording import Acted, Seen, steps_of


class Update(NamedTuple):
    """What came of one rollout, to be pushed as a gradient."""

    gradient: NDArray[np.float32]
    """Gradient of the loss by the flat parameters, clipped, [P]; valid until the next call."""
    frames: int
    loss: Loss
    finished: list[EpisodeResult]


class Trajectory(NamedTuple):
    """One rollout, to be pushed as it was acted."""

    steps: Steps
    rooms: tuple[RoomUsed, ...]
    """The rooms that the steps count."""
    scenes: tuple[str, ...]
    """The scenes whose graphs were used, if the policy has the zone layer."""
    frames: int
    finished: list[EpisodeResult]


class Collector:
    """Owns the policy copy, the environment and the recurrent state of one actor.

    Args:
        config: Configuration of the run.
        env: Environment of ``config.batch`` episodes, with at least one room before the first rollout.
        rng: Source of the actions.
        clock: Measures how long the way back over a rollout takes.

    Attributes:
        parameters: The policy's parameters and their gradients; see `load`.
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
        self._version = 0
        self._tape = self._policy.tape(config.rollout_steps, config.batch)
        self._bank = GraphBank(config.zones, config.edge_cost, config.subgoal)
        self._state: State = self._policy.initial_state(config.batch)
        self._expert = ExpertTable() if self._policy.imitates or config.approach_weight else None

    def load(self, parameters: NDArray[np.float32], version: int) -> None:
        """Act with these parameters from the next rollout on.

        Args:
            parameters: [P].
            version: Theirs; the weight of what is imitated depends on it.
        """
        self.parameters.load(parameters)
        self._version = version

    def use_graph(self, graph: SceneGraph) -> None:
        """Use a scene graph from the next step on.

        Episodes that hold a copy of the scene's earlier graph copy this one anew: merging another room may have
        numbered the zones otherwise.

        Raises:
            ValueError: The graph has other zones or categories.
        """
        self._bank.put(graph)
        self._forget_copies(graph.scene)

    def drop_graph(self, scene: str) -> None:
        """Use the graph of a scene no longer, from the next step on; another scene's must be in use."""
        self._bank.available[SCENES.index(scene)] = False
        self._forget_copies(scene)

    def roll_out(self) -> Update:
        """Run T steps in every episode, then go back over them once.

        Raises:
            InvalidValueError: The environment has no rooms.
        """
        start = self._state
        acted, after = self._act()
        rollout = Rollout(
            actions=torch.stack([moment.actions for moment in acted]),
            rewards=_stack(moment.step.reward for moment in acted),
            terminated=_stack(moment.step.terminated for moment in acted),
            truncated=_stack(moment.step.truncated for moment in acted),
            valid=_stack(moment.step.valid for moment in acted),
            values=torch.stack([moment.decision.value for moment in acted]),
            bootstrap=after.decision.value,
            expert=self._expert_actions(acted),
        )
        observation = Observation(*map(np.stack, zip(*(moment.observation for moment in acted), strict=True)))
        guidance = Guidance(*map(torch.stack, zip(*(moment.decision.guidance for moment in acted), strict=True)))
        with self._clock("differentiate"):
            loss = self._differentiator.on_policy(
                rollout, observation, guidance, start, self._bank, self._tape, self._version
            )
        return Update(self.parameters.gradients.numpy(), rollout.frames, loss, _finished(acted))

    def record(self) -> Trajectory:
        """Run T steps in every episode, for somebody else to learn from.

        Raises:
            InvalidValueError: The environment has no rooms.
        """
        acted, after = self._act()
        steps, rooms = steps_of(acted, after, self._env.rooms)
        scenes = tuple(SCENES[index] for index in np.unique(steps.scene))
        return Trajectory(steps, rooms, scenes, int(steps.has(Flag.VALID).sum()), _finished(acted))

    def _forget_copies(self, scene: str) -> None:
        zone = self._state.zone
        stale = zone.scene == SCENES.index(scene)
        self._state = self._state._replace(zone=zone._replace(scene=zone.scene.masked_fill(stale, -1)))

    def _act(self) -> tuple[list[Acted], Seen]:
        """Run T steps in every episode; return them, and what is seen after the last."""
        acted = []
        self._tape.rewind()
        for _ in range(self._config.rollout_steps):
            seen = self._look(self._tape)
            actions = sample_actions(seen.decision.logits, self._rng)
            acted.append(Acted(*seen, actions, self._env.step(actions.numpy())))
            self._state = seen.decision.state
        return acted, self._look()

    def _expert_actions(self, acted: list[Acted]) -> Tensor | None:
        """Look up what the expert might have done at each step, [T, B, 6], if the policy is taught it."""
        if self._expert is None:
            return None
        rooms = self._env.rooms
        for views in rooms[self._expert.rooms :]:
            self._expert.add_room(views)
        starts = np.cumsum([0, *(views.graph.views for views in rooms)])
        visited = np.stack([starts[moment.places.room] + moment.places.view for moment in acted])
        targets = np.stack([moment.observation.target for moment in acted])
        return torch.from_numpy(self._expert.look_up(visited, targets))

    def _look(self, tape: Tape | None = None) -> Seen:
        """Perceive the next step."""
        observation = self._env.observe()
        decision = self._policy.act(observation, self._state, self._bank, tape)
        return Seen(observation, self._env.places(), decision)


def _finished(acted: Iterable[Acted]) -> list[EpisodeResult]:
    return [result for moment in acted for result in moment.step.finished]


def _stack(arrays: Iterable[NDArray[np.generic]]) -> Tensor:
    return torch.from_numpy(np.stack(list(arrays)))
