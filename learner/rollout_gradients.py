"""Computes the gradients of rollouts that actors push by pose ids: sees again what they saw, and goes back over it.

A view is a function of the room's content and the pose, so a rollout travels as some bytes a frame. What else the
policy saw, the learner has: the rooms' views, the scene graphs that it served, and the recurrent state that it had
itself after the actor's rollout before. Where it has not (it was started again, or did not take that rollout), it
begins with the zero state, and learns nothing from the steps of an episode until the next one begins.
"""

from collections import OrderedDict
from collections.abc import Container, Iterable
from typing import Final, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hoz_dist.a3c.differentiation import Behaviour, Differentiator
from hoz_dist.a3c.loss import Loss
from hoz_dist.a3c.norm import gradient_norm
from hoz_dist.config import RunConfig
from hoz_dist.gradient_forms import Vector
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.actions import NO_ACTION
from hoz_dist.nav.categories import SCENES, scene_index
from hoz_dist.nav.feedback import felt
from hoz_dist.nav.observation import Observation
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.sim.expert import ExpertTable
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.row_table import RowTable
from hoz_dist.sim.view_source import StoredViews
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.trajectories import Flag, Steps, TrajectoryPush
from learner.rollout_states import Ended, RolloutStates

GRAPH_VERSIONS: Final = 64
"""Versions of a scene's graph that rollouts may have used; there is one for each of its rooms."""
_BANKS: Final = 16
"""Combinations of graphs that are kept ready."""


class Learnt(NamedTuple):
    """What came of a push."""

    gradient: Vector
    """Clipped, [P]; valid until the next one."""
    frames: int
    """Steps that it was computed from."""
    loss: Loss | None = None
    """The loss, if it was computed here."""


class _OpenRoom(NamedTuple):
    views: RoomViews
    start: int
    """Index of its first view over all rooms."""


class RolloutGradients:
    """Turns rollouts into gradients; does no input or output.

    Args:
        config: Configuration of the run.
    """

    def __init__(self, config: RunConfig) -> None:
        self._config = config
        self._policy = make_policy(config.policy, config.seed)
        self._parameters = FlatParameters(self._policy)
        self._differentiator = Differentiator(config, self._policy, self._parameters)
        self._rooms: dict[RoomId, _OpenRoom] = {}
        self._unusable: dict[RoomId, str] = {}
        """Why rooms cannot be opened."""
        self._source = StoredViews()
        self._transitions: RowTable[np.int32] = RowTable()
        self._expert = ExpertTable() if self._policy.imitates or config.approach_weight else None
        self._epoch = 0
        self._graphs: dict[str, OrderedDict[int, SceneGraph]] = {}
        self._banks: OrderedDict[tuple[tuple[str, int], ...], GraphBank] = OrderedDict()
        self._states = RolloutStates()

    def begin(self, epoch: int, parameters: Tensor, graphs: Iterable[SceneGraph]) -> None:
        """Begin an epoch: forget the states and graphs of the one before; rooms stay open.

        Args:
            epoch: The epoch.
            parameters: [P] f32, where they are changed.
            graphs: The scene graphs so far.
        """
        self._epoch = epoch
        self._parameters.live_in(parameters)
        self._states.clear()
        self._graphs.clear()
        self._banks.clear()
        for graph in graphs:
            self.use_graph(graph)

    def use_graph(self, graph: SceneGraph) -> None:
        """Let rollouts be guided by a version of a scene graph, besides the last ones before."""
        versions = self._graphs.setdefault(graph.scene, OrderedDict())
        versions[graph.version] = graph
        if len(versions) > GRAPH_VERSIONS:
            versions.popitem(last=False)

    def add_room(self, views: RoomViews) -> None:
        """Open a room, if it is not open."""
        if views.room in self._rooms:
            return
        self._rooms[views.room] = _OpenRoom(views, len(self._transitions))
        self._transitions.append(np.asarray(views.graph.transitions))
        self._source.add_room(views)
        if self._expert is not None:
            self._expert.add_room(views)

    def has_room(self, room: RoomId) -> bool:
        """Tell whether a room is open."""
        return room in self._rooms

    def refuse_room(self, room: RoomId, detail: str) -> None:
        """Refuse what happened in a room that cannot be opened here."""
        self._unusable[room] = detail

    def missing(self, push: TrajectoryPush, explored: Container[str]) -> list[RoomId]:
        """Return the rooms of a rollout that are not open yet.

        Args:
            push: The rollout.
            explored: Names of the rooms whose graph an actor has pushed; no others are worth opening.

        Raises:
            RejectedError: The rollout is not of the run's shape, or in rooms that cannot be opened.
        """
        self._check_shape(push.steps)
        if strange := [used.room for used in push.rooms if not self._config.tells(used.room.scene)]:
            raise RejectedError(Reason.RANGE, f"the run's scene layer has no output for that of {strange[0]}")
        missing = [used.room for used in push.rooms if used.room not in self._rooms]
        for room in missing:
            if room in self._unusable:
                raise RejectedError(Reason.DIGEST, f"{room} cannot be made here: {self._unusable[room]}")
            if str(room) not in explored:
                raise RejectedError(Reason.STALE, f"the graph of {room} is not known; push it first")
        return missing

    def learn(self, push: TrajectoryPush) -> Learnt:
        """Compute the gradient of a rollout of which `missing` returned no rooms.

        Raises:
            RejectedError: The rollout is not one of this run, or cannot have been made in these rooms.
        """
        steps, rooms = push.steps, [self._rooms[used.room] for used in push.rooms]
        self._check(push, rooms)
        bank = self._bank(push)
        views = np.array([room.start for room in rooms], np.int64)[steps.room] + steps.view.astype(np.int64)
        self._check_moves(steps, views)
        before = self._states.before(push.actor, push.incarnation, push.sequence)
        batch = steps.action.shape[1]
        start = self._policy.initial_state(batch) if before is None else before.state
        known = _known(torch.zeros(batch, dtype=torch.bool) if before is None else before.known, steps)
        observation = self._observation(steps, views, rooms)
        behaviour = _behaviour(steps, known, self._expert_actions(views[:-1], observation.target[:-1]))
        guidance = Guidance(
            scene=_long(steps.scene),
            fresh=torch.from_numpy(steps.has(Flag.FRESH)),
            current=_long(steps.current),
            subgoal=_long(steps.subgoal),
        )
        loss, state = self._differentiator.off_policy(behaviour, observation, guidance, start, bank, push.version)
        gradient = self._parameters.gradients.numpy()
        if not np.isfinite(gradient_norm(gradient)):
            raise RejectedError(Reason.INTERNAL, "the gradient of the rollout is not finite")
        self._states.keep(push.actor, Ended.after(push, state, known[-1]))
        return Learnt(gradient, int(behaviour.valid.sum()), loss)

    def _observation(self, steps: Steps, views: NDArray[np.int64], rooms: list[_OpenRoom]) -> Observation:
        """Return what the actor observed at views over all rooms, [T + 1, B, ...]."""
        scenes = np.array([scene_index(room.views.room.scene) for room in rooms])
        return Observation(
            *self._source.look(views),
            target=steps.target.astype(np.int64),
            previous_action=_previous_actions(steps),
            scene=scenes[steps.room],
            first=steps.has(Flag.FIRST),
        )

    def _expert_actions(self, views: NDArray[np.int64], targets: NDArray[np.int64]) -> Tensor | None:
        """Look up what the expert might have done at views over all rooms, [T, B, 6], if the policy is taught it."""
        return None if self._expert is None else torch.from_numpy(self._expert.look_up(views, targets))

    def _check_shape(self, steps: Steps) -> None:
        expected = (self._config.rollout_steps, self._config.batch)
        if steps.action.shape != expected:
            raise RejectedError(Reason.SHAPE, f"a rollout of {steps.action.shape}; those of the run are {expected}")

    def _check(self, push: TrajectoryPush, rooms: list[_OpenRoom]) -> None:
        """Judge a rollout by the run's configuration and by the rooms."""
        steps, config = push.steps, self._config
        for used, room in zip(push.rooms, rooms, strict=True):
            if used.digest != room.views.digest:
                raise RejectedError(Reason.DIGEST, f"{used.room} has another content here")
        counts = np.array([room.views.graph.views for room in rooms])[steps.room]
        if (steps.view >= counts).any():
            raise RejectedError(Reason.RANGE, "a view that its room does not have")
        if max(steps.current.max(), steps.subgoal.max()) >= config.zones:
            raise RejectedError(Reason.RANGE, f"a zone that graphs of {config.zones} zones do not have")
        if config.policy.zone_layer:
            told = {scene_index(graph.scene) for graph in push.graphs}
            if unknown := set(np.unique(steps.scene).tolist()) - told:
                names = ", ".join(SCENES[index] for index in sorted(unknown))
                raise RejectedError(Reason.FIELDS, f"graphs lacks what was used of {names}")

    def _check_moves(self, steps: Steps, views: NDArray[np.int64]) -> None:
        """Judge whether each action leads to the next view; views over all rooms, [T + 1, B]."""
        actions = steps.action[..., np.newaxis].astype(np.int64)
        following = np.take_along_axis(self._transitions.take(views[:-1]), actions, axis=2)[..., 0]
        if ((following != steps.view[1:]) & steps.has(Flag.VALID)[:-1]).any():
            raise RejectedError(Reason.RANGE, "an action does not lead to the view that follows")

    def _bank(self, push: TrajectoryPush) -> GraphBank:
        """Return the graphs that a rollout was guided by; none without the zone layer.

        Raises:
            RejectedError: One of them is not, or no longer, known.
        """
        guiding = {SCENES[index] for index in np.unique(push.steps.scene)} if self._config.policy.zone_layer else set()
        graphs = []
        for one in push.graphs:
            if one.scene not in guiding:
                continue
            versions = self._graphs.get(one.scene, OrderedDict())
            graph = versions.get(one.version)
            if graph is None or one.epoch != self._epoch:
                detail = f"graph {one.version} of {one.scene}, of epoch {one.epoch}, is not known"
                raise RejectedError(Reason.STALE, detail)
            graphs.append(graph)
        key = tuple((graph.scene, graph.version) for graph in graphs)
        if key not in self._banks:
            by_scene = {graph.scene: graph for graph in graphs}
            self._banks[key] = GraphBank.of(by_scene, self._config.zones, self._config.edge_cost, self._config.subgoal)
            if len(self._banks) > _BANKS:
                self._banks.popitem(last=False)
        self._banks.move_to_end(key)
        return self._banks[key]


def _known(before: Tensor, steps: Steps) -> Tensor:
    """Return at which steps the state of an episode is known, [T, B].

    Args:
        before: Of which it was before the first step, [B].
        steps: The steps.
    """
    begun = torch.from_numpy(steps.has(Flag.FIRST)[:-1]).cumsum(dim=0) > 0
    return begun | before


def _behaviour(steps: Steps, known: Tensor, expert: Tensor | None) -> Behaviour:
    """Return what the actor did, and the expert might have done; where the state is not known nothing is learnt."""
    valid = torch.from_numpy(steps.has(Flag.VALID)[:-1])
    return Behaviour(
        actions=_long(steps.action),
        rewards=torch.from_numpy(steps.reward.copy()),
        terminated=torch.from_numpy(steps.has(Flag.TERMINATED)[:-1]),
        truncated=torch.from_numpy(steps.has(Flag.TRUNCATED)[:-1]),
        valid=valid & known,
        log_probabilities=torch.from_numpy(steps.log_probability.copy()),
        taken=int(valid.sum()),
        expert=expert,
    )


def _previous_actions(steps: Steps) -> NDArray[np.int64]:
    """Return the action before each row, as it was felt, [T + 1, B]."""
    # An action stays in its room; where the room changes, an episode begins.
    stayed = steps.view[1:] == steps.view[:-1]
    after = np.where(steps.has(Flag.FIRST)[1:], NO_ACTION, felt(steps.action.astype(np.int64), stayed))
    return np.concatenate([steps.previous_action[None], after]).astype(np.int64)


def _long(values: NDArray[np.uint8]) -> Tensor:
    return torch.from_numpy(values.astype(np.int64))
