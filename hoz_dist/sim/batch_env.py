"""B training episodes at once over several rooms, with autoreset."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.observation import Observation
from hoz_dist.sim.episode_batch import EpisodeBatch
from hoz_dist.sim.episodes import TRAINING_PITCHES, EpisodeSampler
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_source import ViewSource


class Step(NamedTuple):
    """What a step did in each of B slots."""

    reward: NDArray[np.float32]
    """[B]; 0 where the step only reset."""
    terminated: NDArray[np.bool_]
    """Whether the episode ended with Done, [B]."""
    truncated: NDArray[np.bool_]
    """Whether the episode was cut off at its cap, [B]."""
    valid: NDArray[np.bool_]
    """Whether the action was taken, [B]; False where the step only reset."""
    finished: list[EpisodeResult]
    """The episodes that ended in this step, in the order of their slots."""


class Places(NamedTuple):
    """Where B agents are; with the contents of the rooms all that an observation is a function of."""

    room: NDArray[np.int64]
    """Number of each slot's room, in the order of `BatchEnv.rooms`, [B]."""
    view: NDArray[np.int64]
    """View within the room, [B]."""


class BatchEnv:
    """B episodes that step together, over rooms that may be added at any time.

    Autoreset is Gymnasium's NEXT_STEP: the step after an episode's end ignores its action and starts the next episode.
    The last observation of a truncated episode is thus observed, and its value can be bootstrapped.
    """

    def __init__(
        self,
        batch: int,
        rng: np.random.Generator,
        max_actions: int | None = None,
        *,
        pitches: tuple[int, ...] = TRAINING_PITCHES,
        source: ViewSource | None = None,
    ) -> None:
        """Make an environment without rooms; the first episodes start at the first `observe` or `step`.

        Args:
            batch: B.
            rng: Source of all episodes.
            max_actions: Cap on actions of an episode; None takes the scene's `evaluation_cap`.
            pitches: Pitches at the start of an episode, degrees.
            source: Where observations come from; stored views by default.
        """
        self._rng = rng
        self._sampler = EpisodeSampler(pitches)
        self._episodes = EpisodeBatch(batch, max_actions, source)
        self._waiting = np.ones(batch, dtype=np.bool_)
        self._has_rooms = False
        self._started = False

    @property
    def views(self) -> NDArray[np.int64]:
        """View of each slot over all rooms, [B]; changes with the next step."""
        return self._episodes.views

    @property
    def rooms(self) -> Sequence[RoomViews]:
        """The rooms, in the order in which they were added."""
        return self._episodes.rooms

    def places(self) -> Places:
        """Return where each slot's agent is: what `observe` shows is seen from there.

        Raises:
            InvalidValueError: There are no rooms yet.
        """
        self._ensure_started()
        return Places(self._episodes.room_numbers.copy(), self._episodes.local_views())

    def add_room(self, views: RoomViews) -> None:
        """Let new episodes also come from a room.

        Raises:
            InvalidValueError: No episode can start in the room.
        """
        self._sampler.add_room(views)
        self._episodes.add_room(views)
        self._has_rooms = True

    def observe(self) -> Observation:
        """Show what each slot's agent sees now.

        Raises:
            InvalidValueError: There are no rooms yet.
        """
        self._ensure_started()
        return self._episodes.observe()

    def step(self, actions: NDArray[np.int64]) -> Step:
        """Take one action in each slot, or start the next episode where the last one has ended.

        Args:
            actions: [B].

        Raises:
            InvalidValueError: There are no rooms yet.
        """
        self._ensure_started()
        valid = ~self._waiting
        outcome = self._episodes.act(actions, valid)
        self._start_waiting()
        self._waiting = outcome.terminated | outcome.truncated
        finished = [self._episodes.result(slot, outcome) for slot in np.flatnonzero(self._waiting).tolist()]
        return Step(*outcome, valid, finished)

    def _ensure_started(self) -> None:
        if self._started:
            return
        if not self._has_rooms:
            message = "The environment has no rooms yet: add a room before stepping."
            raise InvalidValueError(message)
        self._start_waiting()
        self._waiting[:] = False
        self._started = True

    def _start_waiting(self) -> None:
        for slot in np.flatnonzero(self._waiting).tolist():
            self._episodes.start(slot, *self._sampler.sample(self._rng))
