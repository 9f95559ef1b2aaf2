"""Fitness of a drawn scene: no overlap and no unavoidable collision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import Final

from chauffeur.concept import VehicleState
from chauffeur.worlds.base import EGO

_ROOM_M: Final = 2.0
"""Clear way between two cars, one behind the other; IDM's own at a stand."""
_SIDE_M: Final = 0.3
_RESPONSE_S: Final = 0.5
_BRAKING_MPS2: Final = 4.0
"""What the rear one brakes with, half a second on; the front one goes on as it does. IDM's comfortable braking."""
_ALONG: Final = math.cos(math.radians(40.0))
"""Cosine of the angle to another vehicle below which one drives along with it (`safety.shield.frame.CROSSING_RAD`)."""
_FAR_M: Final = 150.0
"""Way that no speed of these roads needs to be braked away in."""


def fit_to_begin(everybody: Sequence[VehicleState]) -> bool:
    """True if no vehicle has crashed or overlaps another, and each that comes up behind another can still brake for it.

    Args:
        everybody: The ego and all that is solid around it; stop signs are not.
    """
    solid = [one for one in everybody if one.kind != "stop_sign"]
    if any(one.crashed for one in solid):
        return False
    return not any(_bound_to_meet(one, other) for one, other in combinations(solid, 2) if _near(one, other))


def _near(one: VehicleState, other: VehicleState) -> bool:
    return abs(one.x_m - other.x_m) < _FAR_M and abs(one.y_m - other.y_m) < _FAR_M


def _bound_to_meet(one: VehicleState, other: VehicleState) -> bool:
    if math.cos(one.heading_rad - other.heading_rad) < _ALONG:
        reach = (math.hypot(one.length_m, one.width_m) + math.hypot(other.length_m, other.width_m)) / 2.0
        return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) < reach
    along, across = _seen_from(one, other)
    if abs(across) > (one.width_m + other.width_m) / 2.0 + _SIDE_M:
        return False
    rear, front = (one, other) if along >= 0.0 else (other, one)
    merges = front.kind == "obstacle" and rear.id != EGO  # the traffic leaves a lane that ends before it does
    closing = 0.0 if merges else max(0.0, rear.speed_mps - max(0.0, front.speed_mps))
    needed = _ROOM_M + closing * _RESPONSE_S + closing**2 / (2.0 * _BRAKING_MPS2)
    return abs(along) - (one.length_m + other.length_m) / 2.0 < needed


def _seen_from(one: VehicleState, other: VehicleState) -> tuple[float, float]:
    """(way along, way across) to another, in the direction of the first."""
    c, s = math.cos(one.heading_rad), math.sin(one.heading_rad)
    dx, dy = other.x_m - one.x_m, other.y_m - one.y_m
    return c * dx + s * dy, -s * dx + c * dy
