"""The agents that can be evaluated: a trained policy, the floor (Random) and the ceiling (Oracle)."""

from typing import NamedTuple, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hoz_dist.evaluation.protocol import TEMPERATURE
from hoz_dist.graph.planner import target_zone
from hoz_dist.nav.actions import Action
from hoz_dist.policy.actor_critic import ActorCritic
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.sampling import sample_actions
from hoz_dist.policy.state import Decision
from hoz_dist.sim.episode_runner import EpisodeRunner
from hoz_dist.sim.expert import expert_actions
from hoz_dist.sim.room_views import RoomViews


class ZonePlan(NamedTuple):
    """What the graph told an agent: of B episodes at one step [B], or of one episode at each of its actions [A]."""

    scene: NDArray[np.integer]
    """Scene whose graph is used, index into `SCENES`; zones of different scenes have nothing to do with each other."""
    current: NDArray[np.integer]
    """Current zone."""
    target: NDArray[np.integer]
    """Target zone."""
    subgoal: NDArray[np.integer]
    """Sub-goal zone."""


class Agent(Protocol):
    """Chooses the actions of a batch of episodes."""

    name: str

    def begin(self, runner: EpisodeRunner, rng: np.random.Generator) -> None:
        """Prepare for the episodes of a runner, none of which has made a step yet."""
        ...

    def act(self, runner: EpisodeRunner) -> NDArray[np.int64]:
        """Choose an action for each episode, [B]; those of ended episodes are ignored."""
        ...


class RandomAgent:
    """Draws each of the six actions with equal probability: the floor."""

    name = "random"

    def begin(self, runner: EpisodeRunner, rng: np.random.Generator) -> None:
        """Prepare for the episodes of a runner."""
        self._batch, self._rng = len(runner.episodes), rng

    def act(self, runner: EpisodeRunner) -> NDArray[np.int64]:
        """Choose an action for each episode, [B]."""
        del runner
        return self._rng.integers(len(Action), size=self._batch)


class OracleAgent:
    """Follows a shortest path, which it is told, and says Done: the ceiling."""

    name = "oracle"

    def __init__(self, rooms: list[RoomViews]) -> None:
        """Know the rooms.

        Args:
            rooms: The rooms of the episodes.
        """
        self._actions = {views.room: expert_actions(views) for views in rooms}

    def begin(self, runner: EpisodeRunner, rng: np.random.Generator) -> None:
        """Prepare for the episodes of a runner; nothing is drawn."""
        del rng
        self._episodes = runner.episodes

    def act(self, runner: EpisodeRunner) -> NDArray[np.int64]:
        """Choose an action for each episode, [B]: the expert's."""
        actions = np.full(len(self._episodes), int(Action.DONE))
        for slot in np.flatnonzero(runner.active).tolist():
            episode = self._episodes[slot]
            actions[slot] = self._actions[episode.room][runner.local_views[slot], episode.target]
        return actions


class PolicyAgent:
    """Samples from a trained policy."""

    def __init__(self, name: str, policy: ActorCritic, bank: GraphBank, temperature: float = TEMPERATURE) -> None:
        """Take a policy.

        Args:
            name: Its method.
            policy: The network.
            bank: The scene graphs that it is guided by.
            temperature: By which logits are divided before actions are drawn.
        """
        self.name = name
        self._policy = policy
        self._bank = bank
        self._temperature = temperature

    def begin(self, runner: EpisodeRunner, rng: np.random.Generator) -> None:
        """Prepare for the episodes of a runner."""
        self._batch, self._rng = len(runner.episodes), rng
        self._state = self._policy.initial_state(self._batch)
        self._slots = np.arange(self._batch)
        """The episodes that the state is of."""
        self._targets = np.array([episode.target for episode in runner.episodes])
        self._decision: Decision | None = None

    def act(self, runner: EpisodeRunner) -> NDArray[np.int64]:
        """Choose an action for each episode, [B]."""
        self._forget_ended(runner)
        decision = self._policy.act(runner.observe(self._slots), self._state, self._bank)
        self._state, self._decision = decision.state, decision
        logits = torch.zeros(self._batch, decision.logits.shape[1])
        logits[torch.from_numpy(self._slots)] = decision.logits
        # An action is drawn for every episode, so that what one draws does not depend on which others have ended.
        return sample_actions(logits, self._rng, self._temperature).numpy()

    def _forget_ended(self, runner: EpisodeRunner) -> None:
        """Drop ended episodes whenever they are half of what is computed: the last ones run much longer than most."""
        running = runner.active[self._slots]
        if 2 * running.sum() <= len(running):
            self._state = self._state.select(torch.from_numpy(np.flatnonzero(running)))
            self._slots = self._slots[running]

    def zone_plan(self) -> ZonePlan | None:
        """Return what guided the last actions, [B]; None before the first ones and without the zone layer.

        Of episodes that have ended it says nothing of use.
        """
        if self._decision is None or not self._policy.settings.zone_layer:
            return None
        guidance, nodes = self._decision.guidance, self._decision.state.zone.nodes
        # As the navigator finds it, in the graph as updated so far this episode.
        target = target_zone(nodes.numpy(), self._targets[self._slots])
        return ZonePlan(
            *map(self._spread, (guidance.scene, guidance.current, torch.from_numpy(target), guidance.subgoal))
        )

    def _spread(self, values: Tensor) -> NDArray[np.integer]:
        """Return values of the episodes that are computed among all, [B]."""
        spread = np.zeros(self._batch, np.int64)
        spread[self._slots] = values.numpy()
        return spread
