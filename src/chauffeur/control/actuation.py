"""LaMPilot's mapping from controller output to motion.

LaMPilot's autopilot returns an acceleration in m/s2 and a steering angle in rad, but its environment reads the pair as
normalised pedal and wheel positions: it clips both to [-1, 1] and multiplies them by 5 m/s2 and by 45 degrees (60 at
the intersection). So every ask beyond 1 m/s2 is full throttle or full brake. Its traffic and scores rest on that, and
so does every comparison with it; the scaling is named here instead of hidden.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Actuation:
    """Full-scale values of pedal and wheel."""

    max_acceleration_mps2: float
    max_steering_rad: float


LAMPILOT_HIGHWAY = Actuation(5.0, math.pi / 4)
LAMPILOT_INTERSECTION = Actuation(5.0, math.pi / 3)


def full_scale(value: float, bound: float) -> float:
    """`value` clipped to [-1, 1] and mapped linearly onto [-bound, bound]."""
    clipped = max(-1.0, min(1.0, value))
    # In this form, not as a product: the last bit then equals the linear map of the highway-env package.
    return -bound + (clipped + 1.0) * (2.0 * bound) / 2.0
