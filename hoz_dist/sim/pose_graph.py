"""Which poses a room has, where each action leads from each of them, and how far they are from a goal.

A *view* is the index of a pose: ``view = (position * 8 + yaw_index) * 2 + pitch_index``.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.actions import Action
from hoz_dist.nav.pose import GRID_M, HEADINGS, PITCHES, VIEWS_PER_POSITION, YAWS, Pose

if TYPE_CHECKING:  # processes that only look views up do without PyBullet
    from hoz_dist.sim.world import World


@dataclass(frozen=True, eq=False)
class PoseGraph:
    """The poses of a room and the legal moves between them."""

    positions: NDArray[np.int16]
    """Grid coordinates (x / 0.25 m, z / 0.25 m) of the reachable positions, [P, 2]."""
    transitions: NDArray[np.int32]
    """View after each action from each view, [V, 6]; an illegal move and Done keep the view."""

    @property
    def views(self) -> int:
        """V, the number of poses."""
        return len(self.transitions)

    @property
    def pitch_indices(self) -> NDArray[np.intp]:
        """Index into `PITCHES` of every view, [V]."""
        return np.arange(self.views) % len(PITCHES)

    def places(self, views: NDArray[np.integer]) -> NDArray[np.float64]:
        """Return where the camera stands at views [M]: (x, z) in metres, [M, 2]."""
        return np.asarray(self.positions[views // VIEWS_PER_POSITION] * GRID_M)

    @cached_property
    def _position_index(self) -> dict[tuple[int, int], int]:
        return {(int(x), int(z)): index for index, (x, z) in enumerate(self.positions)}

    def pose(self, view: int) -> Pose:
        """Return the pose of a view."""
        rest, pitch = divmod(int(view), len(PITCHES))
        position, yaw = divmod(rest, len(YAWS))
        x, z = self.positions[position]
        return Pose(float(x) * GRID_M, float(z) * GRID_M, YAWS[yaw], PITCHES[pitch])

    def view_of(self, pose: Pose) -> int:
        """Return the view of a pose.

        Raises:
            InvalidValueError: The room has no such pose.
        """
        position = self._position_index.get((round(pose.x / GRID_M), round(pose.z / GRID_M)))
        if position is None or pose.yaw not in YAWS or pose.pitch not in PITCHES:
            message = f"Pose {pose.key} is not one that the agent can take in this room."
            raise InvalidValueError(message)
        return (position * len(YAWS) + YAWS.index(pose.yaw)) * len(PITCHES) + PITCHES.index(pose.pitch)

    def distances_to(self, goal: NDArray[np.bool_]) -> NDArray[np.int16]:
        """Return the least number of actions, Done not counted, from every view to any goal view.

        Breadth-first from all goals at once; each round takes every pending view one of whose actions leads to a view
        that is already reached. O(V * longest distance), all in array operations.

        Args:
            goal: Whether a view is a goal, [V].

        Returns:
            Distances, [V]; 0 at goals, -1 where no goal can be reached.
        """
        distances = np.where(goal, 0, -1).astype(np.int16)
        pending = np.flatnonzero(~goal)
        steps = 0
        while pending.size:
            steps += 1
            reached = (distances[self.transitions[pending, : Action.DONE]] >= 0).any(axis=1)
            if not reached.any():
                break
            distances[pending[reached]] = steps
            pending = pending[~reached]
        return distances


def build_pose_graph(world: "World") -> PoseGraph:
    """Find where the agent can stand in the loaded room, and its legal moves, by the world's collision queries.

    Args:
        world: A world with a room loaded.

    Returns:
        The graph over the largest set of free grid positions that are connected by legal moves.

    Raises:
        InvalidValueError: The agent can stand nowhere in the room.
    """
    room = world.room
    cells = [
        (x, z)
        for x in range(int(room.width / GRID_M) + 1)
        for z in range(int(room.depth / GRID_M) + 1)
        if world.is_free(x * GRID_M, z * GRID_M)
    ]
    if not cells:
        message = f"Room {room.room} has no position where the agent can stand."
        raise InvalidValueError(message)
    return pose_graph_of(np.array(cells, dtype=np.int16), _neighbours(world, cells))


def pose_graph_of(cells: NDArray[np.int16], neighbours: NDArray[np.int32]) -> PoseGraph:
    """Make the pose graph over the largest connected set of positions.

    Args:
        cells: Grid coordinates of free positions, [C, 2].
        neighbours: Position that MoveAhead reaches at each yaw, [C, 8]; -1 where it is blocked.
    """
    source, heading = np.nonzero(neighbours >= 0)
    links = coo_array((np.ones(len(source)), (source, neighbours[source, heading])), shape=(len(cells), len(cells)))
    labels = connected_components(links, directed=False)[1]
    kept = np.flatnonzero(labels == np.bincount(labels).argmax())
    renumbered = np.full(len(cells) + 1, -1, dtype=np.int32)
    renumbered[kept] = np.arange(len(kept))
    return PoseGraph(positions=cells[kept], transitions=_transitions(renumbered[neighbours[kept]]))


def _neighbours(world: "World", cells: list[tuple[int, int]]) -> NDArray[np.int32]:
    """Ask the world for the moves between neighbouring positions, [C, 8]; -1 where blocked.

    A move is asked for in one direction and holds both ways, so that the agent can always go back.
    """
    index = {cell: number for number, cell in enumerate(cells)}
    neighbours = np.full((len(cells), len(HEADINGS)), -1, dtype=np.int32)
    half_turn = len(HEADINGS) // 2
    for (x, z), here in index.items():
        for heading in range(half_turn):
            dx, dz = HEADINGS[heading]
            there = index.get((x + dx, z + dz))
            if there is None:
                continue
            if world.can_move(x * GRID_M, z * GRID_M, (x + dx) * GRID_M, (z + dz) * GRID_M):
                neighbours[here, heading] = there
                neighbours[there, heading + half_turn] = here
    return neighbours


def _transitions(neighbours: NDArray[np.int32]) -> NDArray[np.int32]:
    """Expand moves between P positions to transitions between V views, [V, 6]."""
    yaws, pitches = len(YAWS), len(PITCHES)
    position, yaw, pitch = np.indices((len(neighbours), yaws, pitches))

    def view(
        position: NDArray[np.integer], yaw: NDArray[np.integer], pitch: NDArray[np.integer] | int
    ) -> NDArray[np.int32]:
        return ((position * yaws + yaw) * pitches + pitch).astype(np.int32).ravel()

    ahead = neighbours[position, yaw]
    transitions = np.empty((position.size, len(Action)), dtype=np.int32)
    transitions[:, Action.MOVE_AHEAD] = view(np.where(ahead >= 0, ahead, position), yaw, pitch)
    transitions[:, Action.ROTATE_LEFT] = view(position, (yaw - 1) % yaws, pitch)
    transitions[:, Action.ROTATE_RIGHT] = view(position, (yaw + 1) % yaws, pitch)
    transitions[:, Action.LOOK_UP] = view(position, yaw, np.maximum(pitch - 1, 0))
    transitions[:, Action.LOOK_DOWN] = view(position, yaw, np.minimum(pitch + 1, pitches - 1))
    transitions[:, Action.DONE] = view(position, yaw, pitch)
    return transitions
