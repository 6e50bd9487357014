"""Object-goal navigation as a Gymnasium environment."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.nav.actions import NO_ACTION, Action
from hoz_dist.nav.categories import TARGETS, category_index
from hoz_dist.nav.episode import Episode, evaluation_cap
from hoz_dist.nav.feedback import PREVIOUS_ACTIONS, felt
from hoz_dist.nav.pose import PICTURE_SIZE
from hoz_dist.nav.reward import STEP_REWARD, SUCCESS_REWARD
from hoz_dist.nav.rooms import RoomId, Split, rooms_of
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.detections import Detector
from hoz_dist.sim.episodes import EVALUATION_PITCHES, TRAINING_PITCHES, EpisodeSampler
from hoz_dist.sim.painter import Painter
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_store import ViewStore

FARTHEST_M: Final = 20.0
"""Bound of depths, metres: the camera's far plane."""


class NoFeatures:
    """The visual encoder of an environment that shows pictures themselves: C = 0 features."""

    key: Final = "none"
    channels: Final = 0
    grid: Final = 1

    def encode(self, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> NDArray[np.float16]:
        """Return [M, 0, 1, 1]."""
        del depth
        return np.empty((len(rgb), self.channels, self.grid, self.grid), dtype=np.float16)


class _View(NamedTuple):
    """What the agent sees, and whether Done would succeed."""

    rgb: NDArray[np.uint8]
    """[S, S, 3]."""
    depth: NDArray[np.float32]
    """[S, S]."""
    detections: NDArray[np.float32]
    """[N, 5]."""
    success: NDArray[np.bool_]
    """[N]."""


class ObjectNavEnv(gymnasium.Env[dict[str, Any], np.int64]):
    """Find an object of a given category in a room, and say so when close to it.

    ## Description

    An agent stands in a furnished room. It is told the category of an object, the target, and moves until it sees an
    instance of it at most 1.5 m away; then it has to say Done. Rooms, actions, rewards and metrics follow Zhang et al.,
    "Hierarchical Object-to-Zone Graph for Object Navigation" (ICCV 2021).

    ## Action Space

    `Discrete(6)`; an action that is not possible leaves the agent where it is.

    | Num | Action      | Effect                                                                           |
    |-----|-------------|----------------------------------------------------------------------------------|
    | 0   | MoveAhead   | One step on the 0.25 m grid along the yaw; on a diagonal along both axes         |
    | 1   | RotateLeft  | Yaw - 45 degrees                                                                 |
    | 2   | RotateRight | Yaw + 45 degrees                                                                 |
    | 3   | LookUp      | Pitch 0                                                                          |
    | 4   | LookDown    | Pitch 30 degrees down                                                            |
    | 5   | Done        | Ends the episode; succeeds if the target is seen and at most 1.5 m away          |

    ## Observation Space

    A `Dict`, S the picture size:

    | Key               | Space                      | Content                                                         |
    |-------------------|----------------------------|-----------------------------------------------------------------|
    | `rgb`             | `Box` uint8 (S, S, 3)      | Colours, field of view 90 degrees, 1.58 m above the floor       |
    | `depth`           | `Box` float32 (S, S)       | Metres along the viewing axis, 0 to 20                          |
    | `detections`      | `Box` float32 (22, 5)      | Box (x0, y0, x1, y1) over S and confidence of each category     |
    | `target`          | `Discrete(22)`             | Index of the target in `hoz_dist.nav.categories.TARGETS`        |
    | `previous_action` | `Discrete(9)`              | The last action; 6 at the start, 7 and 8 if it failed           |

    A previous action of 7 is a MoveAhead, one of 8 a LookUp or LookDown, that left the agent or the camera where it was
    (`hoz_dist.nav.feedback`).

    ## Rewards

    -0.01 for every action, and 5 more when Done succeeds.

    ## Starting State

    Drawn uniformly: a room, a target that it holds, a pose from which the target can be reached and Done would not
    succeed yet. The pitch is 0 in training rooms, 0 or 30 degrees in others.

    ## Episode End

    1. Termination: Done.
    2. Truncation: `max_actions` actions (by default 100, in living rooms 200, in apartments 500) without Done.

    The environment does not reset itself (`metadata["autoreset_mode"]` is `DISABLED`); Gymnasium's vector environments
    do so as they declare. `hoz_dist.sim.batch_env.BatchEnv` is the fast way to run many episodes.

    ## Information

    `room`, `target` (its name), `pose` (x and z in metres, yaw and pitch in degrees), `optimal` (L*, least number of
    actions before Done from the start), `actions` (taken so far), `success` (whether Done was said and succeeded).

    ## Arguments

    ```python
    >>> import gymnasium
    >>> import hoz_dist.sim.registration
    >>> env = gymnasium.make("hoz_dist/ObjectNav-v0", rooms="kitchen", split="val")  # doctest: +SKIP
    >>> observation, info = env.reset(seed=1, options={"target": "Microwave"})       # doctest: +SKIP
    ```

    | Parameter      | Type                 | Default     | Description                                             |
    |----------------|----------------------|-------------|---------------------------------------------------------|
    | `rooms`        | str, sequence of str | `"kitchen"` | Scenes (all rooms of the split) and rooms (`kitchen/3`) |
    | `split`        | str                  | `"train"`   | `train`, `val` or `test`: rooms that a scene stands for |
    | `picture_size` | int                  | 64          | S                                                       |
    | `max_actions`  | int                  | None        | Cap on actions of an episode                            |
    | `live`         | bool                 | False       | Render every step instead of looking stored views up    |
    | `cache`        | str, Path            | None        | View cache; by default `HOZ_CACHE` or the user's cache  |

    `reset` takes the options `room` (such as `"kitchen/3"`) and `target` (such as `"Microwave"`).
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 # so declared by gymnasium.Env
        "render_modes": ["rgb_array"],
        "render_fps": 4,
        "autoreset_mode": AutoresetMode.DISABLED,
    }

    def __init__(
        self,
        rooms: str | Sequence[str] = "kitchen",
        *,
        split: Split = "train",
        picture_size: int = PICTURE_SIZE,
        max_actions: int | None = None,
        live: bool = False,
        cache: str | Path | None = None,
        render_mode: Literal["rgb_array"] | None = None,
    ) -> None:
        """See the class.

        Raises:
            HozError: A room or a split does not exist, or a value is out of range.
        """
        names = (rooms,) if isinstance(rooms, str) else tuple(rooms)
        self._rooms = _resolve(names, split)
        if max_actions is not None and max_actions < 1:
            message = f"max_actions is {max_actions}; an episode needs at least 1 action."
            raise InvalidValueError(message)
        self.render_mode = render_mode
        self._size = picture_size
        self._max_actions = max_actions
        self._live = live
        self._store = ViewStore(None if cache is None else Path(cache), picture_size)
        self._opened: dict[RoomId, tuple[RoomViews, EpisodeSampler]] = {}
        self._live_room: tuple[RoomId, Painter, Detector] | None = None
        self._episode: Episode | None = None
        self._ended = True
        self._views: RoomViews
        self._view = 0
        self._actions = 0
        self._previous_action = NO_ACTION
        picture = (picture_size, picture_size)
        self.action_space = spaces.Discrete(len(Action))
        self.observation_space = spaces.Dict(
            {
                "rgb": spaces.Box(0, 255, (*picture, 3), np.uint8),
                "depth": spaces.Box(0.0, FARTHEST_M, picture, np.float32),
                "detections": spaces.Box(0.0, 1.0, (len(TARGETS), 5), np.float32),
                "target": spaces.Discrete(len(TARGETS)),
                "previous_action": spaces.Discrete(PREVIOUS_ACTIONS),
            }
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seeds the draws of this and later episodes.
            options: ``room`` and ``target`` where they are not to be drawn.

        Raises:
            HozError: There is no such room or target, or the room does not hold the target.
        """
        super().reset(seed=seed)
        wishes = options or {}
        room = self._rooms[self.np_random.integers(len(self._rooms))]
        if "room" in wishes:
            room = RoomId.parse(wishes["room"])
        target = category_index(wishes["target"]) if "target" in wishes else None
        self._views, sampler = self._open(room)
        _, self._episode = sampler.sample(self.np_random, target)
        self._ended = False
        self._view = self._episode.start
        self._actions = 0
        self._previous_action = NO_ACTION
        return self._observation(self._look()), self._info(success=False)

    def step(self, action: np.int64) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Take an action.

        Args:
            action: Index of an `Action`.

        Raises:
            ResetNeeded: There is no episode, or it has ended.
            InvalidValueError: There is no such action.
        """
        episode = self._current()
        if self._ended:
            message = "The episode has ended: call reset()."
            raise ResetNeeded(message)
        if not self.action_space.contains(action):
            message = f"Action {action!r} is not one of 0 to {len(Action) - 1}."
            raise InvalidValueError(message)
        before, self._view = self._view, int(self._views.graph.transitions[self._view, action])
        self._actions += 1
        self._previous_action = int(felt(np.asarray(action), np.asarray(self._view == before)))
        view = self._look()
        terminated = int(action) == Action.DONE
        success = terminated and bool(view.success[episode.target])
        cap = evaluation_cap(episode.room.scene) if self._max_actions is None else self._max_actions
        truncated = not terminated and self._actions >= cap
        self._ended = terminated or truncated
        reward = STEP_REWARD + SUCCESS_REWARD * success
        return self._observation(view), reward, terminated, truncated, self._info(success=success)

    def render(self) -> NDArray[np.uint8] | None:
        """Return what the agent sees, [S, S, 3], in render mode ``rgb_array``; otherwise None."""
        if self.render_mode is None:
            return None
        self._current()
        return self._look().rgb

    def close(self) -> None:
        """End PyBullet if it was started; closing twice does nothing."""
        if self._live_room is not None:
            self._live_room[1].close()
            self._live_room = None

    def _open(self, room: RoomId) -> tuple[RoomViews, EpisodeSampler]:
        """Return a room's views and a sampler of its episodes; its first call may render the room."""
        if room not in self._opened:
            views = self._store.open(room, NoFeatures())
            sampler = EpisodeSampler(TRAINING_PITCHES if room.split == "train" else EVALUATION_PITCHES)
            sampler.add_room(views)
            self._opened[room] = (views, sampler)
        return self._opened[room]

    def _look(self) -> _View:
        """Return what the agent sees from its view."""
        if self._live:
            return self._render_view()
        frames = self._store.frames(self._views.room, np.array([self._view]))
        return _View(
            frames.rgb[0],
            frames.depth[0].astype(np.float32),
            np.array(self._views.detections[self._view]),
            self._views.success[self._view],
        )

    def _render_view(self) -> _View:
        """Render what the agent sees with PyBullet."""
        room, graph = self._views.room, self._views.graph
        if self._live_room is None or self._live_room[0] != room:
            self.close()
            content = load_room(room)
            self._live_room = (room, Painter(content, self._size), Detector(content))
        _, painter, detector = self._live_room
        frames = painter.paint(graph, [self._view])
        found = detector.detect(frames.segmentation, graph.places(np.array([self._view])))
        return _View(frames.rgb[0], frames.depth[0].astype(np.float32), found.detections[0], found.success[0])

    def _current(self) -> Episode:
        """Return the episode.

        Raises:
            ResetNeeded: There is none.
        """
        if self._episode is None:
            message = "Call reset() first."
            raise ResetNeeded(message)
        return self._episode

    def _observation(self, view: _View) -> dict[str, Any]:
        return {
            "rgb": view.rgb,
            "depth": view.depth,
            "detections": view.detections,
            "target": np.int64(self._current().target),
            "previous_action": np.int64(self._previous_action),
        }

    def _info(self, *, success: bool) -> dict[str, Any]:
        episode = self._current()
        return {
            "room": str(episode.room),
            "target": TARGETS[episode.target],
            "pose": self._views.graph.pose(self._view),
            "optimal": episode.optimal,
            "actions": self._actions,
            "success": success,
        }


def _resolve(names: tuple[str, ...], split: Split) -> tuple[RoomId, ...]:
    """Return the rooms that names stand for, each once, in the order of the names.

    Raises:
        HozError: A scene, room or split does not exist, or there are no names.
    """
    if split not in ("train", "val", "test"):
        raise UnknownNameError.of("split", split, ("train", "val", "test"))
    if not names:
        message = "An environment needs at least one room."
        raise InvalidValueError(message)
    rooms = [room for name in names for room in ((RoomId.parse(name),) if "/" in name else rooms_of(name, split))]
    return tuple(dict.fromkeys(rooms))
