"""The agent's camera: colours, depth and segmentation of a pose, drawn on the CPU."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.pose import CAMERA_HEIGHT_M, FIELD_OF_VIEW_DEG, PICTURE_SIZE, Pose
from hoz_dist.sim.bullet import pybullet
from hoz_dist.sim.world import World

NEAR_M: Final = 0.05
FAR_M: Final = 20.0
ASIDE_M: Final = (1e-4, 1.7e-4)
"""How far the eye is beside its pose, (x, z) in metres: too little to show.

Where a corner of a surface lies exactly in the camera's own plane, PyBullet's renderer gives depths that are not
numbers, or never ends. Things are placed in whole millimetres and poses at multiples of 45 degrees, so this happens;
with the step aside it does not.
"""
_LIGHT_DIRECTION: Final = (1.0, -2.0, 3.0)
"""Towards the light, (x, z, height); oblique, so that the faces of a box differ."""
_AMBIENT: Final = 0.7
_DIFFUSE: Final = 0.36


class Frame(NamedTuple):
    """What the camera sees from one pose."""

    rgb: NDArray[np.uint8]
    """Colours, [S, S, 3]."""
    depth: NDArray[np.float32]
    """Distance along the viewing axis, metres, [S, S]."""
    segmentation: NDArray[np.uint8]
    """Index of the room's item plus 1, 0 where there is nothing, [S, S]."""


class Camera:
    """Draws the world from poses of the agent with PyBullet's TinyRenderer: no display and no GPU needed."""

    def __init__(self, world: World, size: int = PICTURE_SIZE) -> None:
        """Look into a world.

        Args:
            world: The world; it may load other rooms later.
            size: Side of the square pictures, pixels.
        """
        self.world = world
        self.size = size
        self._projection = pybullet.computeProjectionMatrixFOV(FIELD_OF_VIEW_DEG, 1.0, NEAR_M, FAR_M)

    def render(self, pose: Pose) -> Frame:
        """Draw what an agent at a pose sees."""
        yaw, pitch = np.deg2rad(pose.yaw), np.deg2rad(pose.pitch)
        eye = (pose.x + ASIDE_M[0], pose.z + ASIDE_M[1], CAMERA_HEIGHT_M)
        ahead = (np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), -np.sin(pitch))
        aim = [float(e + a) for e, a in zip(eye, ahead, strict=True)]
        view = pybullet.computeViewMatrix(eye, aim, (0.0, 0.0, 1.0))
        _, _, colours, buffer, bodies = pybullet.getCameraImage(
            self.size,
            self.size,
            view,
            self._projection,
            shadow=0,
            lightDirection=_LIGHT_DIRECTION,
            lightColor=(1.0, 1.0, 1.0),
            lightAmbientCoeff=_AMBIENT,
            lightDiffuseCoeff=_DIFFUSE,
            lightSpecularCoeff=0.0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self.world.client,
        )
        shape = (self.size, self.size)
        rgb = np.ascontiguousarray(np.reshape(colours, (*shape, 4))[..., :3], dtype=np.uint8)
        # The buffer b in [0, 1] of an OpenGL projection: depth = far near / (far - (far - near) b).
        depth = FAR_M * NEAR_M / (FAR_M - (FAR_M - NEAR_M) * np.reshape(buffer, shape).astype(np.float64))
        return Frame(rgb, depth.astype(np.float32), self.world.labels[np.reshape(bodies, shape) + 1])
