"""Running a fixed list of episodes to the end, every one of them counted."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.episode import Episode, EpisodeResult
from hoz_dist.nav.observation import Observation
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.episode_batch import EpisodeBatch, Outcome
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_source import ViewSource


class EpisodeRunner:
    """Runs all episodes of a list side by side, slot i holding episode i; those that have ended wait for the others.

    Slots are never refilled: counting whichever parallel episodes end first would favour short ones.

    Example:
        >>> while runner.active.any():                              # doctest: +SKIP
        ...     runner.step(choose_actions(runner.observe()))
        >>> metrics_of(runner.results())                            # doctest: +SKIP
    """

    def __init__(
        self,
        rooms: Sequence[RoomViews],
        episodes: Sequence[Episode],
        max_actions: int | None = None,
        source: ViewSource | None = None,
    ) -> None:
        """Put every episode at its start.

        Args:
            rooms: The rooms of the episodes.
            episodes: What to run.
            max_actions: Cap on actions of an episode; None takes the scene's `evaluation_cap`.
            source: Where observations come from; stored views by default.

        Raises:
            InvalidValueError: An episode's room is not among the rooms.
        """
        self._episodes = tuple(episodes)
        self._batch = EpisodeBatch(len(episodes), max_actions, source)
        numbers: dict[RoomId, int] = {views.room: self._batch.add_room(views) for views in rooms}
        for slot, episode in enumerate(episodes):
            if episode.room not in numbers:
                message = f"Episode {slot} is in room {episode.room}, which is not loaded."
                raise InvalidValueError(message)
            self._batch.start(slot, numbers[episode.room], episode)
        self.active = np.ones(len(episodes), dtype=np.bool_)
        """Whether an episode is still running, [B]."""
        self._results: list[EpisodeResult | None] = [None] * len(episodes)
        self._trace = [self._batch.local_views()]

    @property
    def episodes(self) -> tuple[Episode, ...]:
        """The episodes, in the order of their slots."""
        return self._episodes

    @property
    def local_views(self) -> NDArray[np.int64]:
        """View of each episode within its own room, [B]."""
        return self._batch.local_views()

    def observe(self, slots: NDArray[np.int64] | None = None) -> Observation:
        """Show what the agents of some episodes see now, of all when None; an ended one keeps its last view."""
        return self._batch.observe(slots)

    def step(self, actions: NDArray[np.int64]) -> Outcome:
        """Take one action in each running episode.

        Args:
            actions: [B]; those of ended episodes are ignored.
        """
        outcome = self._batch.act(actions, self.active)
        self._trace.append(self._batch.local_views())
        ended = outcome.terminated | outcome.truncated
        for slot in np.flatnonzero(ended).tolist():
            self._results[slot] = self._batch.result(slot, outcome)
        self.active = self.active & ~ended
        return outcome

    def results(self) -> list[EpisodeResult]:
        """Return how every episode went, in the order of the list.

        Raises:
            RuntimeError: An episode is still running.
        """
        results = [result for result in self._results if result is not None]
        if len(results) < len(self._results):
            message = "Results are complete only when no episode is active."
            raise RuntimeError(message)
        return results

    def trajectories(self) -> list[NDArray[np.int64]]:
        """Return the views (within its own room) that each episode has visited so far, its start first."""
        trace = np.stack(self._trace)
        return [trace[: self._taken(slot) + 1, slot] for slot in range(trace.shape[1])]

    def _taken(self, slot: int) -> int:
        """Return the number of actions that an episode has taken so far."""
        result = self._results[slot]
        return len(self._trace) - 1 if result is None else result.actions
