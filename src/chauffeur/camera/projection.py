"""From a scene into a camera: matrices, and what of the scene is in sight."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.camera.solids import Solids, X, Y, Z

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.camera.rig import Camera, Rig
    from chauffeur.geometry import Pose

    FloatArray = NDArray[np.float64]

NEAR_M: Final = 0.15
FAR_M: Final = 900.0
_LEAST_PX: Final = 0.8


@dataclass(frozen=True)
class Viewpoint:
    """A camera in a scene.

    Attributes:
        camera: The camera.
        position_m: In the scene's frame (3,).
        rotation: Camera frame (x right, y down, z ahead) to the scene's frame (3, 3).
    """

    camera: Camera
    position_m: FloatArray
    rotation: FloatArray

    @property
    def clip(self) -> FloatArray:
        """Scene to clip space (4, 4). The first row that is read back is the top of the image."""
        camera = self.camera
        (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
        w, h = camera.width, camera.height
        # Image v grows downwards and so does the row that is read back: no picture is ever flipped.
        lens = np.array(
            [
                [2.0 * fx / w, 0.0, 2.0 * cx / w - 1.0, 0.0],
                [0.0, 2.0 * fy / h, 2.0 * cy / h - 1.0, 0.0],
                [0.0, 0.0, (FAR_M + NEAR_M) / (FAR_M - NEAR_M), -2.0 * FAR_M * NEAR_M / (FAR_M - NEAR_M)],
                [0.0, 0.0, 1.0, 0.0],
            ]
        )
        view = np.eye(4)
        view[:3, :3] = self.rotation.T
        view[:3, 3] = -self.rotation.T @ self.position_m
        return lens @ view

    @property
    def unproject(self) -> FloatArray:
        """(x, y, 1, 1) of the screen, normalised, to a ray in the scene's frame (4, 4)."""
        camera = self.camera
        (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
        rays = np.array(
            [
                [camera.width / (2.0 * fx), 0.0, (camera.width / 2.0 - cx) / fx],
                [0.0, camera.height / (2.0 * fy), (camera.height / 2.0 - cy) / fy],
                [0.0, 0.0, 1.0],
            ]
        )
        found = np.zeros((4, 4))
        found[:3, :3] = self.rotation @ rays
        return found

    def seen(self, solids: Solids) -> NDArray[np.bool_]:
        """Mask of solids that may be in sight and large enough to show, (n,)."""
        if not len(solids):
            return np.zeros(0, bool)
        camera = self.camera
        places = solids.rows[:, [X, Y, Z]] - self.position_m.astype(np.float32)
        x, y, z = (places @ self.rotation.astype(np.float32)).T
        radius = solids.radii
        found = (z > NEAR_M - radius) & (radius * camera.focal_px[0] > _LEAST_PX * 0.5 * z)
        for along, focal, low, size in (
            (x, camera.focal_px[0], camera.centre_px[0], camera.width),
            (y, camera.focal_px[1], camera.centre_px[1], camera.height),
        ):
            for slope, sign in ((low / focal, -1.0), ((size - low) / focal, 1.0)):
                found &= (sign * along - slope * z) / math.hypot(1.0, slope) < radius
        return found


def viewpoints(rig: Rig, ego: Pose) -> list[Viewpoint]:
    """The cameras of a rig on a vehicle whose middle is at a pose of the scene."""
    c, s = math.cos(ego.heading_rad), math.sin(ego.heading_rad)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    found: list[Viewpoint] = []
    for camera in rig.cameras:
        x, y, z = camera.position_m
        place = turn @ np.array([x + rig.origin_ahead_m, y, z]) + np.array([ego.x_m, ego.y_m, 0.0])
        found.append(Viewpoint(camera, place, turn @ camera.rotation))
    return found
