"""The state of B episodes that run side by side, and what one action does to each of them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.actions import NO_ACTION, Action
from hoz_dist.nav.categories import scene_index
from hoz_dist.nav.episode import Episode, EpisodeResult, evaluation_cap
from hoz_dist.nav.feedback import felt
from hoz_dist.nav.observation import Observation
from hoz_dist.nav.reward import STEP_REWARD, SUCCESS_REWARD
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.row_table import RowTable
from hoz_dist.sim.view_source import StoredViews, ViewSource


class Outcome(NamedTuple):
    """What one action did in each of B episodes."""

    reward: NDArray[np.float32]
    """[B]; 0 where nothing happened."""
    terminated: NDArray[np.bool_]
    """Whether Done was said, [B]."""
    truncated: NDArray[np.bool_]
    """Whether the episode reached its cap without Done, [B]."""


class EpisodeBatch:
    """B slots, each of which holds an episode; views are indexed over all rooms in the order of `add_room`."""

    def __init__(self, batch: int, max_actions: int | None = None, source: ViewSource | None = None) -> None:
        """Make a batch without rooms whose slots are empty.

        Args:
            batch: B, the number of slots.
            max_actions: Cap on actions of an episode; None takes the scene's `evaluation_cap`.
            source: Where observations come from; stored views by default.
        """
        self.views = np.zeros(batch, dtype=np.int64)
        """View of each slot over all rooms, [B]."""
        self.room_numbers = np.zeros(batch, dtype=np.int64)
        """Number of the room of each slot, [B]."""
        self._source: ViewSource = StoredViews() if source is None else source
        self._max_actions = max_actions
        self._transitions: RowTable[np.int64] = RowTable()
        self.rooms: list[RoomViews] = []
        """The rooms, in the order of `add_room`."""
        self._room_starts: list[int] = []
        self._target = np.zeros(batch, dtype=np.int64)
        self._scene = np.zeros(batch, dtype=np.int64)
        self._optimal = np.zeros(batch, dtype=np.int64)
        self._cap = np.zeros(batch, dtype=np.int64)
        self._actions = np.zeros(batch, dtype=np.int64)
        self._moves = np.zeros(batch, dtype=np.int64)
        self._previous = np.full(batch, NO_ACTION, dtype=np.int64)

    def add_room(self, views: RoomViews) -> int:
        """Append a room and return its number."""
        offset = len(self._transitions)
        self._transitions.append(views.graph.transitions.astype(np.int64) + offset)
        self._source.add_room(views)
        self.rooms.append(views)
        self._room_starts.append(offset)
        return len(self.rooms) - 1

    def start(self, slot: int, room_number: int, episode: Episode) -> None:
        """Put an episode into a slot."""
        scene = episode.room.scene
        self.views[slot] = self._room_starts[room_number] + episode.start
        self.room_numbers[slot] = room_number
        self._target[slot] = episode.target
        self._scene[slot] = scene_index(scene)
        self._optimal[slot] = episode.optimal
        self._cap[slot] = evaluation_cap(scene) if self._max_actions is None else self._max_actions
        self._actions[slot] = 0
        self._moves[slot] = 0
        self._previous[slot] = NO_ACTION

    def observe(self, slots: NDArray[np.int64] | None = None) -> Observation:
        """Show what the agents of some slots see now, [slots, ...]; of all slots when None."""
        chosen = np.arange(len(self.views)) if slots is None else slots
        return Observation(
            *self._source.look(self.views[chosen]),
            target=self._target[chosen],
            previous_action=self._previous[chosen],
            scene=self._scene[chosen],
            first=self._actions[chosen] == 0,
        )

    def act(self, actions: NDArray[np.int64], active: NDArray[np.bool_]) -> Outcome:
        """Take one action in each active slot; the others stay as they are.

        Args:
            actions: [B].
            active: [B].
        """
        terminated = active & (actions == Action.DONE)
        reward = np.where(active, np.float32(STEP_REWARD), np.float32(0.0))
        done = np.flatnonzero(terminated)
        if done.size:
            reward[done] += SUCCESS_REWARD * self._source.succeeds(self.views[done], self._target[done])
        after = self._transitions.pick(self.views, actions)
        np.copyto(self._previous, felt(actions, after == self.views), where=active)
        np.copyto(self.views, after, where=active)
        self._actions += active
        self._moves += active & (actions == Action.MOVE_AHEAD)
        truncated = active & ~terminated & (self._actions >= self._cap)
        return Outcome(reward, terminated, truncated)

    def result(self, slot: int, outcome: Outcome) -> EpisodeResult:
        """Sum up the episode of a slot that has just ended."""
        said_done = bool(outcome.terminated[slot])
        return EpisodeResult(
            room=self.rooms[self.room_numbers[slot]].room,
            target=int(self._target[slot]),
            success=said_done and bool(outcome.reward[slot] > 0),
            actions=int(self._actions[slot]),
            moves=int(self._moves[slot]),
            said_done=said_done,
            optimal=int(self._optimal[slot]),
        )

    def local_views(self) -> NDArray[np.int64]:
        """Return the view of each slot within its own room, [B]."""
        return self.views - np.asarray(self._room_starts, dtype=np.int64)[self.room_numbers]
