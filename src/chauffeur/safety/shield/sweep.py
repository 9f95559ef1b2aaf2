"""Where the ego gets across the road: one period under a command, then back to its lane.

The same kinematic bicycle and lane keeping as the vehicle's own, so that a command is accepted exactly if the shield
could still bring the car back after it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

from chauffeur.control import LAMPILOT_STEERING, LaneKeepingParameters, lane_keeping_steering
from chauffeur.safety.shield.frame import Body

_PERIODS = 14
"""Periods of coming back that are looked at; by then the car is back, or goes along its lane."""
_HALF_LENGTH_M = LAMPILOT_STEERING.length_m / 2.0
_APPROACH_RAD = 0.2
"""Angle at which the shield comes back to a lane's centre: a slow car turned further would stick out of the lane."""
_STRAIGHT_RAD = 0.02
_CENTRED_M = 0.1


def recovery_steering(ego: Body, centre_m: float, speed_mps: float, most_rad: float, curvature: float = 0.0) -> float:
    """Steering angle, rad, that brings the ego back to a lane's centre; the lane's curvature in 1/m."""
    parameters = _with_wheel(most_rad)
    bend = curvature * speed_mps * parameters.preview_s
    return lane_keeping_steering(speed_mps, ego.heading_rad, ego.d_m - centre_m, bend, parameters)


@lru_cache(maxsize=4)
def _with_wheel(most_rad: float) -> LaneKeepingParameters:
    return replace(LAMPILOT_STEERING, max_steering_rad=most_rad, max_approach_rad=_APPROACH_RAD)


def yaw_rate(speed_mps: float, steering_rad: float) -> float:
    """Rate of turn, rad/s, of the kinematic bicycle."""
    return _turning(speed_mps, _slip(steering_rad))


def _slip(steering_rad: float) -> float:
    """Angle, rad, between the car's heading and where its centre goes."""
    return math.atan(0.5 * math.tan(steering_rad))


def _turning(speed_mps: float, slip_rad: float) -> float:
    return speed_mps * math.sin(slip_rad) / _HALF_LENGTH_M


def swept(
    ego: Body,
    speed_mps: float,
    size_m: tuple[float, float],
    steering_rad: float,
    centre_m: float,
    most_rad: float,
    dt_s: float,
    curvature: float = 0.0,
) -> tuple[float, float]:
    """(lowest, highest) place across the road, m, that any part of the body reaches.

    Args:
        ego: Where it is.
        speed_mps: Its speed, kept.
        size_m: (length, width).
        steering_rad: Angle held for one period.
        centre_m: Lane centre it then comes back to.
        most_rad: Largest steering angle on the way back.
        dt_s: Control period.
        curvature: Of the lane, 1/m.
    """
    parameters = _with_wheel(most_rad)
    half_length, half_width = size_m[0] / 2.0, size_m[1] / 2.0
    bend = curvature * speed_mps  # how fast the lane's heading turns under the car, rad/s
    d, heading = ego.d_m, ego.heading_rad
    low = high = d
    for period in range(_PERIODS + 1):
        wide = abs(math.sin(heading)) * half_length + abs(math.cos(heading)) * half_width
        low, high = min(low, d - wide), max(high, d + wide)
        offset = d - centre_m
        if period and abs(heading) < _STRAIGHT_RAD and abs(offset) < _CENTRED_M:
            break
        if period:
            angle = lane_keeping_steering(speed_mps, heading, offset, bend * parameters.preview_s, parameters)
        else:
            angle = steering_rad
        slip = _slip(angle)
        d += speed_mps * math.sin(heading + slip) * dt_s
        heading += (_turning(speed_mps, slip) - bend) * dt_s
    return low, high
