"""A room inside PyBullet, and the collision queries that say where the agent can be."""

from types import TracebackType
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.pose import AGENT_RADIUS_M
from hoz_dist.sim.bullet import pybullet
from hoz_dist.sim.room import Item, Room

MAX_PARTS: Final = 16
"""PyBullet's limit on the shapes of one shape array; more than this crashes it."""
_AGENT_LOW_M: Final = 0.05
"""The agent's underside: above the floor and above rugs."""
_AGENT_HIGH_M: Final = 1.6
_STORE_HEIGHT_M: Final = -50.0
"""Where the agent's bodies wait, far below the room, so that no picture shows them."""


class World:
    """Owns one PyBullet client and the room that is loaded into it.

    Use it as a context manager; leaving it ends the client and frees its memory.
    """

    def __init__(self, room: Room | None = None) -> None:
        """Start a PyBullet client without a window.

        Args:
            room: The room to load at once, if any.
        """
        self.client: int = pybullet.connect(pybullet.DIRECT)
        """Identifier of the PyBullet client."""
        self.body_items: dict[int, int] = {}
        """Index into the room's items, by PyBullet body id."""
        self.labels: NDArray[np.uint8] = np.zeros(1, dtype=np.uint8)
        """Index into the room's items plus 1, by PyBullet body id plus 1; 0 for no body (-1)."""
        self._room: Room | None = None
        self._cylinder = -1
        self._sweeps: dict[float, int] = {}
        self._free: dict[tuple[float, float], bool] = {}
        if room is not None:
            self.load(room)

    def __enter__(self) -> Self:
        """Return the world itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the PyBullet client."""
        self.close()

    def close(self) -> None:
        """End the PyBullet client; closing twice does nothing."""
        if self.client >= 0:
            pybullet.disconnect(physicsClientId=self.client)
            self.client = -1

    @property
    def room(self) -> Room:
        """The loaded room.

        Raises:
            RuntimeError: No room is loaded.
        """
        if self._room is None:
            message = "No room is loaded."
            raise RuntimeError(message)
        return self._room

    def load(self, room: Room) -> None:
        """Replace what the client holds by a room.

        Raises:
            ValueError: An item has more parts than PyBullet can take.
        """
        pybullet.resetSimulation(physicsClientId=self.client)
        self.body_items = {_create_body(item, self.client): index for index, item in enumerate(room.items)}
        self.labels = np.zeros(max(self.body_items, default=-1) + 2, dtype=np.uint8)
        for body, index in self.body_items.items():
            self.labels[body + 1] = index + 1
        height = _AGENT_HIGH_M - _AGENT_LOW_M
        self._cylinder = self._hidden_body(
            pybullet.createCollisionShape(
                pybullet.GEOM_CYLINDER, radius=AGENT_RADIUS_M, height=height, physicsClientId=self.client
            )
        )
        self._sweeps = {}
        self._free = {}
        self._room = room

    def is_free(self, x: float, z: float) -> bool:
        """Say whether the agent, a cylinder of radius `AGENT_RADIUS_M`, can stand at a point.

        Args:
            x: Metres to the right.
            z: Metres ahead.
        """
        if not (0.0 <= x <= self.room.width and 0.0 <= z <= self.room.depth):
            return False
        if (x, z) not in self._free:
            self._free[x, z] = not self._touches(self._cylinder, (x, z), (0.0, 0.0, 0.0, 1.0))
        return self._free[x, z]

    def can_move(self, x: float, z: float, x2: float, z2: float) -> bool:
        """Say whether the agent can go straight from one point to another.

        The swept volume is checked without gaps: a cylinder at either end and a box between them.

        Args:
            x: Start, metres to the right.
            z: Start, metres ahead.
            x2: End, metres to the right.
            z2: End, metres ahead.
        """
        if not (self.is_free(x, z) and self.is_free(x2, z2)):
            return False
        dx, dz = x2 - x, z2 - z
        length = round((dx * dx + dz * dz) ** 0.5, 6)
        if length == 0.0:
            return True
        if length not in self._sweeps:
            half = (length / 2, AGENT_RADIUS_M, (_AGENT_HIGH_M - _AGENT_LOW_M) / 2)
            shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self.client)
            self._sweeps[length] = self._hidden_body(shape)
        # Half-angle quaternion of the turn that brings the x axis onto (dx, dz).
        cosine = dx / length
        half_cosine = max(0.0, (1.0 + cosine) / 2) ** 0.5
        half_sine = max(0.0, (1.0 - cosine) / 2) ** 0.5 * (1.0 if dz >= 0.0 else -1.0)
        return not self._touches(self._sweeps[length], ((x + x2) / 2, (z + z2) / 2), (0.0, 0.0, half_sine, half_cosine))

    def _hidden_body(self, shape: int) -> int:
        """Make a body for collision queries, out of sight."""
        body: int = pybullet.createMultiBody(
            0.0, shape, basePosition=(0.0, 0.0, _STORE_HEIGHT_M), physicsClientId=self.client
        )
        return body

    def _touches(self, body: int, point: tuple[float, float], turn: tuple[float, float, float, float]) -> bool:
        """Put a query body at a point, say whether it touches an item, and put it away again."""
        centre = (*point, (_AGENT_LOW_M + _AGENT_HIGH_M) / 2)
        client = self.client
        pybullet.resetBasePositionAndOrientation(body, centre, turn, physicsClientId=client)
        low, high = pybullet.getAABB(body, physicsClientId=client)
        near = {found for found, _ in pybullet.getOverlappingObjects(low, high, physicsClientId=client) or ()}
        touches = any(
            pybullet.getClosestPoints(body, other, 0.0, physicsClientId=client)
            for other in near
            if other in self.body_items
        )
        store = (0.0, 0.0, _STORE_HEIGHT_M)
        pybullet.resetBasePositionAndOrientation(body, store, (0.0, 0.0, 0.0, 1.0), physicsClientId=client)
        return touches


def _create_body(item: Item, client: int) -> int:
    """Create the static body of an item; every part keeps its own colour."""
    parts = item.parts
    if not 1 <= len(parts) <= MAX_PARTS:
        message = f"{item.category} has {len(parts)} parts; a body needs 1 to {MAX_PARTS}."
        raise ValueError(message)
    shapes = [pybullet.GEOM_BOX if part.shape == "box" else pybullet.GEOM_CYLINDER for part in parts]
    # One anchor for the body, parts relative to it: PyBullet's bounding boxes are tighter around local frames.
    anchor = parts[0].centre
    frames = [_minus(part.centre, anchor) for part in parts]
    halves = [tuple(extent / 2 for extent in part.size) for part in parts]
    radii = [part.size[0] / 2 for part in parts]
    heights = [part.size[2] for part in parts]
    visual = pybullet.createVisualShapeArray(
        shapeTypes=shapes,
        halfExtents=halves,
        radii=radii,
        lengths=heights,
        visualFramePositions=frames,
        rgbaColors=[(*part.colour, 1.0) for part in parts],
        physicsClientId=client,
    )
    collision = pybullet.createCollisionShapeArray(
        shapeTypes=shapes,
        halfExtents=halves,
        radii=radii,
        lengths=heights,
        collisionFramePositions=frames,
        physicsClientId=client,
    )
    body: int = pybullet.createMultiBody(0.0, collision, visual, anchor, physicsClientId=client)
    return body


def _minus(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, float]:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
