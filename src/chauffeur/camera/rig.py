"""Cameras on a vehicle: intrinsics, mounting, and the rigs of nuScenes and nuPlan.

Frames. Vehicle: x forward, y left, z up, m; its origin is where the rig says (`Rig.origin_ahead_m`), on the ground.
Camera: x right, y down, z along the optical axis (nuScenes, nuPlan, OpenCV). Image: u right, v down, pixel centres
at half integers, so that (0, 0) is the outer corner of the first pixel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final, Self

from chauffeur.concept import ConfigError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera mounted on a vehicle.

    Attributes:
        name: E.g. `front`, `CAM_FRONT`, `CAM_L0`.
        width: Image width, px.
        height: Image height, px.
        focal_px: (fx, fy).
        centre_px: Principal point (cx, cy).
        position_m: Of the optical centre in the vehicle frame (x forward, y left, z up).
        yaw_rad: Direction of the optical axis, counter-clockwise from straight ahead.
        pitch_rad: How far it looks down.
        roll_rad: Rotation about the optical axis, clockwise as the camera sees it.
    """

    name: str
    width: int
    height: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    position_m: tuple[float, float, float]
    yaw_rad: float = 0.0
    pitch_rad: float = 0.0
    roll_rad: float = 0.0

    def __post_init__(self) -> None:
        """Raises ConfigError for an image without pixels or a focal length that is not positive."""
        if self.width < 8 or self.height < 8 or self.width > 4096 or self.height > 4096:
            raise ConfigError(
                f"Camera {self.name} cannot take pictures of {self.width}x{self.height}.", hint="8 to 4096 a side."
            )
        if not all(math.isfinite(f) and f > 0.0 for f in self.focal_px):
            raise ConfigError(f"Camera {self.name} has a focal length of {self.focal_px} px.", hint="Give one above 0.")

    @classmethod
    def of_view(
        cls,
        name: str,
        size: tuple[int, int],
        view_rad: float,
        position_m: tuple[float, float, float],
        yaw_rad: float = 0.0,
        pitch_rad: float = 0.0,
    ) -> Self:
        """A camera with a horizontal angle of view and square pixels, its axis through the middle of the image."""
        width, height = size
        focal = width / 2.0 / math.tan(view_rad / 2.0)
        return cls(name, width, height, (focal, focal), (width / 2.0, height / 2.0), position_m, yaw_rad, pitch_rad)

    @classmethod
    def of_calibration(
        cls,
        name: str,
        size: tuple[int, int],
        translation: Sequence[float],
        rotation: Sequence[float],
        camera_intrinsic: Sequence[Sequence[float]],
    ) -> Self:
        """A camera from a nuScenes `calibrated_sensor` row (nuPlan's sensor2ego has the same meaning).

        Args:
            name: Channel.
            size: Image (width, height), px.
            translation: Of the camera in the ego frame (x forward, y left, z up), m.
            rotation: Quaternion (w, x, y, z), camera frame to ego frame.
            camera_intrinsic: 3x3 matrix, px.
        """
        w, x, y, z = (float(one) for one in rotation)
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w / norm, x / norm, y / norm, z / norm
        ahead = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
        right = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
        down = (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x))
        yaw, pitch = math.atan2(ahead[1], ahead[0]), -math.asin(max(-1.0, min(1.0, ahead[2])))
        (fx, _, cx), (_, fy, cy) = camera_intrinsic[0], camera_intrinsic[1]
        return cls(
            name,
            *size,
            (float(fx), float(fy)),
            (float(cx), float(cy)),
            (float(translation[0]), float(translation[1]), float(translation[2])),
            yaw,
            pitch,
            math.atan2(-right[2], -down[2]),
        )

    @cached_property
    def intrinsics(self) -> FloatArray:
        """K, (3, 3), px."""
        import numpy as np

        return np.array(
            [[self.focal_px[0], 0.0, self.centre_px[0]], [0.0, self.focal_px[1], self.centre_px[1]], [0.0, 0.0, 1.0]]
        )

    @cached_property
    def rotation(self) -> FloatArray:
        """Camera frame (x right, y down, z ahead) to vehicle frame, (3, 3)."""
        import numpy as np

        cy, sy = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        cp, sp = math.cos(self.pitch_rad), math.sin(self.pitch_rad)
        cr, sr = math.cos(self.roll_rad), math.sin(self.roll_rad)
        ahead = np.array([cy * cp, sy * cp, -sp])
        right = np.array([sy, -cy, 0.0])
        down = np.cross(ahead, right)
        return np.stack([cr * right + sr * down, cr * down - sr * right, ahead], axis=1)

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """Camera frame to vehicle frame as nuScenes writes it: (w, x, y, z), w >= 0."""
        m = self.rotation
        w = math.sqrt(max(0.0, 1.0 + m[0, 0] + m[1, 1] + m[2, 2])) / 2.0
        x = math.copysign(math.sqrt(max(0.0, 1.0 + m[0, 0] - m[1, 1] - m[2, 2])) / 2.0, m[2, 1] - m[1, 2])
        y = math.copysign(math.sqrt(max(0.0, 1.0 - m[0, 0] + m[1, 1] - m[2, 2])) / 2.0, m[0, 2] - m[2, 0])
        z = math.copysign(math.sqrt(max(0.0, 1.0 - m[0, 0] - m[1, 1] + m[2, 2])) / 2.0, m[1, 0] - m[0, 1])
        return w, x, y, z

    @property
    def view_rad(self) -> float:
        """Horizontal angle of view."""
        left, right = self.centre_px[0], self.width - self.centre_px[0]
        return math.atan2(left, self.focal_px[0]) + math.atan2(right, self.focal_px[0])

    def project(self, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pixels (n, 2) and depths along the optical axis (n,), m, of points (n, 3) of the vehicle frame.

        Only pixels of positive depth mean anything.
        """
        import numpy as np

        seen = (points_m - np.array(self.position_m)) @ self.rotation
        depth = seen[:, 2]
        safe = np.where(np.abs(depth) < 1e-9, 1e-9, depth)
        pixels = seen[:, :2] / safe[:, None] * np.array(self.focal_px) + np.array(self.centre_px)
        return pixels, depth

    def sized(self, width: int, height: int) -> Self:
        """The same camera with images of another size.

        The horizontal angle of view stays; pixels stay square as they were, so that another aspect ratio shows more
        or less above and below, never a stretched picture.
        """
        scale = width / self.width
        fx, fy = self.focal_px
        cx, cy = self.centre_px
        return replace(
            self,
            width=width,
            height=height,
            focal_px=(fx * scale, fy * scale),
            centre_px=(cx * scale, height / 2.0 + (cy - self.height / 2.0) * scale),
        )


@dataclass(frozen=True)
class Rig:
    """Cameras of one vehicle.

    Attributes:
        name: E.g. `nuscenes`.
        cameras: In the order in which their pictures come.
        origin_ahead_m: Where the vehicle frame's origin lies, m ahead of the middle of the vehicle; negative where it
            is the rear axle (nuScenes, nuPlan).
    """

    name: str
    cameras: tuple[Camera, ...]
    origin_ahead_m: float = 0.0

    def __post_init__(self) -> None:
        """Raises ConfigError where two cameras have one name, or there is none."""
        names = [camera.name for camera in self.cameras]
        if not names or len(set(names)) != len(names):
            raise ConfigError(f"Rig {self.name} has the cameras {names}.", hint="Give each camera its own name.")

    def __getitem__(self, name: str) -> Camera:
        """The camera of a name. Raises ConfigError."""
        for camera in self.cameras:
            if camera.name == name:
                return camera
        known = ", ".join(camera.name for camera in self.cameras)
        raise ConfigError(f"Rig {self.name} has no camera {name!r}.", hint=f"It has: {known}.")

    def sized(self, width: int, height: int) -> Rig:
        """The same rig with images of another size."""
        return replace(self, cameras=tuple(camera.sized(width, height) for camera in self.cameras))

    def only(self, *names: str) -> Rig:
        """The rig with some of its cameras. Raises ConfigError."""
        return replace(self, cameras=tuple(self[name] for name in names))


FRONT_SIZE: Final = (448, 256)


def front_rig(width: int = FRONT_SIZE[0], height: int = FRONT_SIZE[1]) -> Rig:
    """One camera behind the windscreen: 75 degrees wide, 1.45 m above the road, looking 2 degrees down."""
    camera = Camera.of_view("front", (width, height), math.radians(75.0), (0.6, 0.0, 1.45), 0.0, math.radians(2.0))
    return Rig("front", (camera,))


def nuscenes_rig(width: int = 448, height: int = 256) -> Rig:
    """nuScenes' six cameras, nominal: 1600x900 px, 70 degrees wide (the rear one 110), ego origin at the rear axle.

    Angles and positions are those of the published sensor layout, rounded; a calibration of one vehicle comes in by
    `Camera.of_calibration`.
    """
    wide, rear = (1266.0, 1266.0), (809.0, 809.0)
    rows = (
        ("CAM_FRONT", wide, (1.70, 0.0, 1.51), 0.0),
        ("CAM_FRONT_RIGHT", wide, (1.55, -0.49, 1.50), -55.0),
        ("CAM_FRONT_LEFT", wide, (1.52, 0.49, 1.51), 55.0),
        ("CAM_BACK", rear, (0.03, 0.0, 1.58), 180.0),
        ("CAM_BACK_LEFT", wide, (1.04, 0.48, 1.59), 110.0),
        ("CAM_BACK_RIGHT", wide, (1.01, -0.48, 1.56), -110.0),
    )
    cameras = tuple(
        Camera(name, 1600, 900, focal, (816.0, 491.0), where, math.radians(yaw)) for name, focal, where, yaw in rows
    )
    return Rig("nuscenes", cameras, -1.39).sized(width, height)


def nuplan_rig(width: int = 448, height: int = 256) -> Rig:
    """nuPlan's eight cameras, nominal: 1920x1080 px, 64 degrees wide, ego origin at the rear axle."""
    rows = (
        ("CAM_F0", (1.65, 0.0, 1.53), 0.0),
        ("CAM_L0", (1.60, 0.45, 1.53), 55.0),
        ("CAM_R0", (1.60, -0.45, 1.53), -55.0),
        ("CAM_L1", (1.10, 0.55, 1.53), 100.0),
        ("CAM_R1", (1.10, -0.55, 1.53), -100.0),
        ("CAM_L2", (0.60, 0.45, 1.53), 143.0),
        ("CAM_R2", (0.60, -0.45, 1.53), -143.0),
        ("CAM_B0", (-0.50, 0.0, 1.53), 180.0),
    )
    cameras = tuple(
        Camera(name, 1920, 1080, (1545.0, 1545.0), (960.0, 560.0), where, math.radians(yaw))
        for name, where, yaw in rows
    )
    return Rig("nuplan", cameras, -1.46).sized(width, height)


RIGS: Final = {"front": front_rig, "nuscenes": nuscenes_rig, "nuplan": nuplan_rig}


def rig_of(name: str, width: int = 448, height: int = 256) -> Rig:
    """A preset by name. Raises ConfigError."""
    if name not in RIGS:
        raise ConfigError(f"There is no camera rig {name!r}.", hint=f"Choose of: {', '.join(RIGS)}.")
    return RIGS[name](width, height)
