"""Between CARLA's left-handed frame (m, degrees) and ours: x is the same, y and yaw change sign."""

from __future__ import annotations

import math
from typing import Any

from chauffeur.geometry import Pose, wrap_to_pi


def pose_of(transform: Any) -> Pose:
    """A `carla.Transform` as a pose."""
    place, turn = transform.location, transform.rotation
    return Pose(float(place.x), -float(place.y), wrap_to_pi(-math.radians(float(turn.yaw))))


def transform_of(carla: Any, pose: Pose, z_m: float = 0.0) -> Any:
    """A pose as a `carla.Transform` at a height."""
    location = carla.Location(x=pose.x_m, y=-pose.y_m, z=z_m)
    return carla.Transform(location, carla.Rotation(yaw=-math.degrees(pose.heading_rad)))


def forward_mps(velocity: Any, heading_rad: float) -> float:
    """Speed along a heading, of a `carla.Vector3D` velocity."""
    return float(velocity.x) * math.cos(heading_rad) - float(velocity.y) * math.sin(heading_rad)
