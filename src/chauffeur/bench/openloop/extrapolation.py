"""The next three seconds from a car's own motion: the baselines that see nothing.

All arrays are as in `nuscenes.PlanningSample`: history (5, 3) and future (steps, 2), ego frame, 0.5 s apart.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from chauffeur.foreign.waypoints import FUTURE, STEP_S

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

_STANDING_MPS: Final = 0.5
_APART_M: Final = 1.5
"""Farther from constant velocity than this after 3 s, something has happened."""
_STAYS_M: Final = 0.3
_STARTS_M: Final = 1.0
"""After 2 s: a light that turns green later than that is in no picture."""
_STEADY_MPS: Final = 0.25
_STEADY_RAD: Final = 0.04

FutureKind = Literal["stays", "starts", "turns", "brakes", "speeds up", "goes on"]
FUTURE_KINDS: Final[tuple[FutureKind, ...]] = get_args(FutureKind)


def constant_velocity(history: FloatArray, steps: int = FUTURE) -> FloatArray:
    """Straight on as fast as over the last half second, (steps, 2)."""
    speed = float(np.hypot(*(history[-1, :2] - history[-2, :2]))) / STEP_S
    ahead = speed * STEP_S * np.arange(1, steps + 1)
    return np.stack((ahead, np.zeros(steps)), axis=1).astype(np.float64)


def constant_turn_and_acceleration(history: FloatArray, steps: int = FUTURE) -> FloatArray:
    """Acceleration and yaw rate of the last second go on (CTRA), until the car stands; (steps, 2)."""
    moved = np.hypot(*np.diff(history[:, :2], axis=0).T) / STEP_S
    acceleration = float(moved[-1] - moved[-2]) / STEP_S
    speed = max(0.0, float(moved[-1]) + acceleration * STEP_S / 2.0)
    rate = float(history[-1, 2] - history[-2, 2]) / STEP_S
    fine, found = 10, np.zeros((steps, 2))
    dt = STEP_S / fine
    x = y = heading = 0.0
    for i in range(steps):
        for _ in range(fine):
            speed = max(0.0, speed + acceleration * dt)
            heading += rate * dt if speed > 0.0 else 0.0
            x, y = x + speed * dt * math.cos(heading), y + speed * dt * math.sin(heading)
        found[i] = x, y
    return found


def tells_nothing(history: FloatArray) -> bool:
    """True if the car's motion of the last second is steady: neither braking nor bend has begun, or it stands."""
    moved = np.hypot(*np.diff(history[:, :2], axis=0).T) / STEP_S
    turned = float(history[-1, 2] - history[-2, 2])
    return abs(float(moved[-1] - moved[-2])) < _STEADY_MPS and abs(turned) < _STEADY_RAD


def kind_of(history: FloatArray, future: FloatArray) -> FutureKind | None:
    """Kind of future that steady motion did not tell; None for a start that comes too late to be seen coming."""
    speed = float(np.hypot(*(history[-1, :2] - history[-2, :2]))) / STEP_S
    if speed < _STANDING_MPS:
        if np.hypot(*future[-1]) < _STAYS_M:
            return "stays"
        return "starts" if np.hypot(*future[3]) > _STARTS_M else None
    off = future[-1] - constant_velocity(history)[-1]
    if np.hypot(*off) < _APART_M:
        return "goes on"
    if abs(off[1]) > abs(off[0]):
        return "turns"
    return "brakes" if off[0] < 0.0 else "speeds up"
